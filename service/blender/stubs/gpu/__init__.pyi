from typing import Any

state: Any
types: Any
