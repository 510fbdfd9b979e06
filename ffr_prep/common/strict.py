"""The base of everything that is read from text files."""

from __future__ import annotations

from collections.abc import Mapping
from difflib import get_close_matches
from typing import Any

from pydantic import BaseModel, ConfigDict, GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema

from ffr_prep.common.docstrings import meanings, prose

_LIST, _TABLE = "must be a list in square brackets", "must be a table"
_WHOLE, _NUMBER, _TRUTH = "must be a whole number", "must be a number", "must be true or false"
_WORDS = {  # by what pydantic calls a mistake; what is not here is said in its words
    "missing": "is required, and missing",
    "list_type": _LIST,
    "tuple_type": _LIST,
    "too_short": "must have at least {min_length} items, and has {actual_length}",
    "too_long": "must have at most {max_length} items, and has {actual_length}",
    "float_type": _NUMBER,
    "float_parsing": _NUMBER,
    "int_type": _WHOLE,
    "int_parsing": _WHOLE,
    "int_from_float": _WHOLE,
    "bool_type": _TRUTH,
    "bool_parsing": _TRUTH,
    "string_type": "must be a text in quotes",
    "dict_type": _TABLE,
    "model_type": _TABLE,
    "model_attributes_type": _TABLE,
    "union_tag_invalid": "there is no {discriminator} {tag!r}; there are {expected_tags}",
    "union_tag_not_found": "needs the entry {discriminator}, which says what it is",
}


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


def complaint(item: Mapping[str, Any]) -> str:
    """What pydantic says is wrong with an entry, in plain words."""
    if item["type"] in _WORDS:
        return _WORDS[item["type"]].format(**item.get("ctx", {}))
    return str(item["msg"]).removeprefix("Value error, ").replace("Input should be", "must be", 1)


def entry_keys(item: Mapping[str, Any], tree: Any) -> tuple[str, ...]:
    """The keys in a tree of an entry that pydantic complains of, items of lists counted from 1, as `-p` takes them. What
    pydantic calls the alternatives of an entry is left out.

    >>> entry_keys({"loc": ("bars", 0, "tube", "d"), "type": "float_type"}, {"bars": [{"d": "x"}]})
    ('bars', '1', 'd')
    """
    keys: list[str] = []
    for key in item["loc"]:
        if isinstance(tree, list) and isinstance(key, int):
            keys, tree = [*keys, str(key + 1)], tree[key] if key < len(tree) else None
        elif isinstance(tree, dict) and (key in tree or (item["type"] == "missing" and key == item["loc"][-1])):
            keys, tree = [*keys, str(key)], tree.get(key)
    return tuple(keys)
