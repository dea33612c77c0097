"""Errors of models that are made in Python, as advice: field, value, allowed range, fix; one line each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import InitErrorDetails, PydanticCustomError
from pydantic_core.core_schema import ErrorType

from insonify.diagnostics.python_values import as_typed, record_typed
from insonify.diagnostics.validation_errors import validation_diagnostics
from insonify.diagnostics.yaml_source import YamlSource

_KNOWN = frozenset(get_args(ErrorType))


class ArgumentsError(ValidationError):
    """Arguments that a model refuses; it prints one line of advice for each, and keeps the errors of the validator."""

    advice = ""

    def __str__(self) -> str:
        """Advice on each argument."""
        return self.advice

    __repr__ = __str__

    def __reduce__(self) -> tuple[Any, ...]:
        """Errors and advice, from which another process makes the error anew."""
        return _restored, (self.title, list(_line_errors(self)), self.advice)


def arguments_error(error: ValidationError, model: type[BaseModel], arguments: Mapping[str, Any]) -> ValidationError:
    """The error of a model's validator with advice on each argument.

    Args:
        error: The error.
        model: Class of the model.
        arguments: Arguments that it was called with.
    """
    source = YamlSource(model.__name__, values=as_typed(arguments), lines={(): 0}, is_call=True)
    record_typed(source, (), source.values)
    faults = validation_diagnostics(error, model, source)
    return _restored(error.title, list(_line_errors(error)), "\n".join(map(str, faults))) if faults else error


def _restored(title: str, errors: list[InitErrorDetails], advice: str) -> ArgumentsError:
    error = ArgumentsError.from_exception_data(title, errors)
    assert isinstance(error, ArgumentsError)
    error.advice = advice
    return error


def _line_errors(error: ValidationError) -> Iterator[InitErrorDetails]:
    """Errors of a validator as it takes them."""
    for item in error.errors(include_url=False):
        kind: Any = item["type"]
        if kind not in _KNOWN:
            kind = PydanticCustomError(kind, "{message}", item.get("ctx", {}) | {"message": item["msg"]})
        details = InitErrorDetails(type=kind, loc=item["loc"], input=item["input"])
        if "ctx" in item and item["type"] in _KNOWN:
            details["ctx"] = item["ctx"]
        yield details
