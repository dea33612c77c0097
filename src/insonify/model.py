"""Base class of all models of a scenario: complete, validated once, then frozen.

A model is a thing of the scene or the sonar: a pulse, an array, a seabed. It holds plain
values in SI with their limits, and has no behaviour.

Where two fields contradict each other, a model validator raises ``field_error(...)``, so that
the error can name the line of the wrong value in a scenario file::

    @model_validator(mode="after")
    def _check_target_depths(self) -> Self:
        if too_deep:
            raise field_error("targets.0.position", "25 m", "is below the seabed. Write a depth of 20 m or less.")
        return self

Where several values can be wrong together, ``raise_errors([...])`` raises all errors at once.
The path starts at the model whose validator raises it.
"""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import wraps
from typing import Annotated, Any, Self, TypeVar

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    ValidationInfo,
    model_validator,
)
from pydantic_core import PydanticCustomError

from insonify.caller_warning import warn_caller
from insonify.diagnostics.argument_errors import arguments_error
from insonify.diagnostics.diagnostic import nearest_word
from insonify.former_names import former_key, former_value
from insonify.units import decibels, si, unit_warning
from insonify.validity import PhysicsWarning


def field_error(path: str, value: object, advice: str) -> PydanticCustomError:
    """The error to raise where one value of a model is wrong in the light of the others.

    Args:
        path: Where the value stands below this model: field names and indices joined by dots.
        value: The value, as a person would write it; None where there is nothing to show.
        advice: What is wrong with it, its limit, and the fix; it reads on after the value.

    Returns:
        An error for a model validator to raise; in Python it reads "path: value advice".
    """
    shown = advice if value is None else f"{value} {advice}"
    return _custom_error([(path, shown)])


def field_errors(errors: Sequence[PydanticCustomError]) -> PydanticCustomError:
    """Several errors of `field_error` as the one error that a validator can raise, one line each.

    Args:
        errors: Errors of `field_error`, at least one.
    """
    return _custom_error([pair for error in errors for pair in (error.context or {})["errors"]])


def _custom_error(errors: list[tuple[str, str]]) -> PydanticCustomError:
    message = "\n".join(f"{path}: {shown}" if path else shown for path, shown in errors)
    return PydanticCustomError("field_error", "{message}", {"message": message, "errors": errors})


def raise_errors(errors: Iterable[PydanticCustomError]) -> None:
    """Raise all errors at once, in one message; without an error do nothing.

    Args:
        errors: Errors of `field_error`.

    Raises:
        PydanticCustomError: All of them in one, for a validator to raise.
    """
    listed = list(errors)
    if listed:
        raise field_errors(listed)


Value = TypeVar("Value")
Instance = TypeVar("Instance", bound="Model")


def evaluated_once(method: Callable[[Instance], Value]) -> Callable[[Instance], Value]:
    """Decorate a method of a model, without arguments, so that its value is evaluated once for each object.

    The value lasts as long as the frozen object. A copy, which may have other fields, has values of its own.
    """

    @wraps(method)
    def evaluated(model: Instance) -> Value:
        values: dict[Callable[[Instance], Value], Value] | None = getattr(model, "_values", None)
        if values is None:
            values = {}
            object.__setattr__(model, "_values", values)
        if method not in values:
            values[method] = method(model)
        return values[method]

    return evaluated


class Model(BaseModel):
    """A frozen, validated thing of the scenario; unknown fields and NaN are refused."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)
    __slots__ = ("_values",)  # of `evaluated_once`: neither copied nor pickled

    def __init__(self, /, **arguments: Any) -> None:
        """Validate the arguments.

        Raises:
            ValidationError: Some are refused, missing or unknown; one line of advice for each.
        """
        try:
            super().__init__(**arguments)
        except ValidationError as error:
            raise arguments_error(error, type(self), arguments) from None

    __init__.__pydantic_base_init__ = True  # type: ignore[attr-defined]  # dictionaries in others are validated at once

    @evaluated_once
    def __hash__(self) -> int:
        """Hash of the fields, evaluated once: whole scenes are keys of caches."""
        return hash(tuple(self.__dict__[name] for name in type(self).model_fields))

    @model_validator(mode="before")
    @classmethod
    def _refuse_former_names(cls, values: Any) -> Any:
        """Report the new name of a key or value that was renamed."""
        if isinstance(values, dict):
            raise_errors(_former_names(cls, values))
        return values

    def __repr_args__(self) -> Iterable[tuple[str | None, Any]]:
        """Values for `repr`: those that were given or differ from their defaults."""
        return self.explicit_values().items()

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """A copy with some fields changed, checked as a new one is.

        Args:
            update: New values by the names of their fields; numbers may have units ("90 deg").
            deep: True if the values that stay are copied too.

        Raises:
            AttributeError: A name is no field of this model; the nearest one is named.
            ValidationError: A value is refused, by itself or beside the others.
        """
        copied = super().model_copy(deep=deep)
        if not update:
            return copied
        for name in update:
            if name not in type(self).model_fields:
                raise AttributeError(_no_field(type(self), name))
        values = copied.explicit_values() | dict(update)
        try:
            return type(self).model_validate(values)
        except ValidationError as error:
            raise arguments_error(error, type(self), values) from None

    def unchecked_copy(self, **changes: Any) -> Self:
        """A copy with some fields changed and nothing checked: for values that are known to fit, where checks cost.

        Args:
            changes: New values by the names of their fields, in SI.

        Raises:
            AttributeError: A name is no field of this model; the nearest one is named.
        """
        for name in changes:
            if name not in type(self).model_fields:
                raise AttributeError(_no_field(type(self), name))
        return super().model_copy(update=changes)

    def explicit_values(self) -> dict[str, Any]:
        """Values of the fields that were given, or that differ from their defaults."""
        return {
            name: getattr(self, name)
            for name, field in type(self).model_fields.items()
            if name in self.model_fields_set or getattr(self, name) != field.get_default(call_default_factory=True)
        }


def _former_names(model: type[BaseModel], values: Mapping[Any, Any]) -> Iterable[PydanticCustomError]:
    """An error for each key and value that was renamed."""
    for name, value in values.items():
        new = "" if name in model.model_fields else former_key(model, str(name))
        if new:
            yield field_error(str(name), None, f"is called {new}. Write {new} instead.")
        new = former_value(model, str(name), value)
        if new:
            yield field_error(str(name), str(value), f"is called {new}. Write {name}: {new}.")


def _no_field(model: type[BaseModel], name: str) -> str:
    """Message about a name that is no field of a model."""
    if former_key(model, name):
        return f"{model.__name__}.{name} is called {model.__name__}.{former_key(model, name)}"
    known = list(model.model_fields)
    near = nearest_word(name, known)
    hint = f"did you mean {near!r}?" if near else f"known: {', '.join(known)}"
    return f"{model.__name__} has no field {name!r}; {hint}"


def _number(value: object) -> object:
    # YAML reads a bare `no` as False, and Python would quietly count that as 0.
    if isinstance(value, bool):
        raise PydanticCustomError("truth_value", "true or false where a number is expected")
    return value


def _quantity(dimension: str) -> BeforeValidator:
    return BeforeValidator(lambda value: si(_number(value), dimension))


def _angle(value: object, info: ValidationInfo) -> object:
    """An angle [rad]; a bare whole number gets a warning, for it was probably meant in degrees."""
    # Text of a file is checked where its lines are known: `insonify.scenario.unit_warnings`.
    if type(value) is int and "folder" not in (info.context or {}):
        doubt = unit_warning(str(value), "angle")
        if doubt:
            warn_caller(f"{info.field_name}: {doubt}", PhysicsWarning)
    return si(_number(value), "angle")


# `units` in the schema is what an error message and the docs print after the number.
Metres = Annotated[float, _quantity("length"), Field(json_schema_extra={"units": "m"})]
Seconds = Annotated[float, _quantity("time"), Field(json_schema_extra={"units": "s"})]
Hertz = Annotated[float, _quantity("frequency"), Field(json_schema_extra={"units": "Hz"})]
Radians = Annotated[float, BeforeValidator(_angle), Field(json_schema_extra={"units": "rad"})]
MetresPerSecond = Annotated[float, _quantity("speed"), Field(json_schema_extra={"units": "m/s"})]
RadiansPerSecond = Annotated[float, _quantity("turn rate"), Field(json_schema_extra={"units": "rad/s"})]
Celsius = Annotated[float, _quantity("temperature"), Field(json_schema_extra={"units": "degC"})]
Decibels = Annotated[
    float, BeforeValidator(lambda value: decibels(_number(value))), Field(json_schema_extra={"units": "dB"})
]


def _below_surface(depth: float) -> float:
    if depth <= 0:
        raise field_error("", f"{depth:g} m", "is at or above the sea surface (0 m). Depths are positive downwards; "
                          "write a depth above 0 m.")  # fmt: skip
    return depth


MAX_DEPTH = 12_000.0
"""Depth of the deepest water [m]."""
Depth = Annotated[Metres, AfterValidator(_below_surface), Field(gt=0, le=MAX_DEPTH)]
"""Depth of a point in the water [m]."""
Coordinate = Annotated[Metres, Field(ge=-1e7, le=1e7)]
"""North or east of a point, or depth of a platform [m]."""
Heading = Annotated[Radians, Field(ge=-4 * math.pi, le=4 * math.pi)]
"""Direction in the horizontal plane, clockwise from north or from an axis, or a sum of two [rad]."""
FullTurn = Annotated[Radians, Field(ge=-2 * math.pi, le=2 * math.pi)]
"""Direction that is no sum: the heading of a platform or the bearing of its arrays [rad]."""
