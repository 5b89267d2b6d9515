# As much of Blender's API as the types of rcsplat_render need: what Blender hands over is Any.
from typing import Any

from . import props as props
from . import types as types

app: Any
context: Any
data: Any
ops: Any
path: Any
utils: Any
