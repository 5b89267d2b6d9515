"""Renders a built-in scene on a server and says how it goes: python3 example.py [ADDRESS]"""

import sys

from rcsplat import Client

with Client(sys.argv[1] if len(sys.argv) > 1 else None) as client:
    job = client.submit("demo:cornell", width=200, height=200, error_tolerance=0.3, labels={"from": "example"})
    for status in job.progress():
        for frame in status.running:
            print(f"job {job.number}: {frame.stage} {100 * frame.fraction:.0f} %")
    image = job.image()
    print(f"{image.shape[1]}x{image.shape[0]}, mean {image.mean():.1f}")
    job.save("image.png", "example.png")
