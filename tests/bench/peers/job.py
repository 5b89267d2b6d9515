"""What one comparison is about, and what a run of one renderer told."""

import dataclasses
import pathlib

import processes


@dataclasses.dataclass
class Job:
    rcsplat: pathlib.Path
    glb: pathlib.Path  # Lambertian
    camera: str
    width: int  # [px]
    height: int
    folder: pathlib.Path  # for files of every kind
    threads: int


@dataclasses.dataclass
class Run:
    renderer: str
    options: str
    threads: int
    cost: processes.Cost
    image: pathlib.Path  # EXR with the layer `indirect`
    mre: float = 0.0  # of the indirect light, mean of |I - R| / (R + 0.01 mean R)
    median: float = 0.0
    bias: float = 0.0  # ratio of the means less 1
