"""Settings as JSON values, as they are kept with a body."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

from ffr_prep.body import content_hash


def described(value: Any) -> Any:
    """Settings as JSON values: a dataclass by its type and fields, an array by its hash, a function by its name."""
    if is_dataclass(value):
        return {"type": type(value).__name__} | {f.name: described(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, Mapping):
        return {str(key): described(entry) for key, entry in value.items()}
    if isinstance(value, (tuple, list)):
        return [described(entry) for entry in value]
    if isinstance(value, np.ndarray):
        return {"shape": list(value.shape), "hash": content_hash(value)}
    if isinstance(value, np.generic):
        return value.item()
    return value.__qualname__ if callable(value) else value
