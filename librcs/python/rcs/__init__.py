"""librcs in Python: global illumination by radiance cache splatting, in this process.

    import rcs
    session = rcs.Session()
    session.show(rcs.load_scene("demo:cornell"))
    result = rcs.render(session, width=320, height=240)
    result.picture["beauty"]   # a numpy array that looks at the library's memory
"""
from rcs._rcs import (Camera, Error, GBuffer, Picture, Records, RenderResult, Scene, Session, Splats, __version__,
                      compare, demo_scene_names, gather_records, load_scene, option_keys, place_records, read, render,
                      render_gbuffer, render_reference, splat, write)

__all__ = ["Camera", "Error", "GBuffer", "Picture", "Records", "RenderResult", "Scene", "Session", "Splats",
           "__version__", "compare", "demo_scene_names", "gather_records", "load_scene", "option_keys", "place_records",
           "read", "render", "render_gbuffer", "render_reference", "splat", "write"]
