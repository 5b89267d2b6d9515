from typing import Any

Vector: Any
