"""The base of everything that is read from text files."""

from __future__ import annotations

from difflib import get_close_matches
from typing import Any

from pydantic import BaseModel, ConfigDict, GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema

from ffr_prep.common.docstrings import meanings, prose


class Strict(BaseModel):
    """Unknown keys are mistakes; numbers must be finite. What the docstring says of a key describes it in the schema."""

    model_config = ConfigDict(extra="forbid", allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _known(cls, given: Any) -> Any:
        known = list(cls.model_fields)
        for key in given if isinstance(given, dict) else ():
            if key not in known:
                close = get_close_matches(str(key), known, 1)
                hint = f"did you mean {close[0]!r}?" if close else f"known are {', '.join(known)}"
                raise ValueError(f"{key!r} is not a known entry here; {hint}")
        return given

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        found = handler(core)
        made = handler.resolve_ref_schema(found)
        said = {key: text for base in reversed(cls.__mro__) for key, text in meanings(_own_doc(base)).items()}
        for key, entry in made.get("properties", {}).items():
            if "const" in entry:
                entry["description"] = f'"{entry["const"]}": which of the entries that may stand here this one is'
            elif key in said:
                entry["description"] = said[key]
        if cls.__doc__:
            made["description"] = prose(cls.__doc__)
        return found


def _own_doc(base: type) -> str | None:
    return base.__doc__ if issubclass(base, Strict) else None
