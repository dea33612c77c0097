"""Part of a job: one of several processes that share the items of a job without a scheduler."""

import re
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Part:
    """One of `count` parts of a job, from 1.

    Example:
        >>> part = insonify.Part(3, 64)
        >>> str(part), part.share(items=1000)
        ('3/64', range(31, 46))
    """

    number: int
    count: int

    def __post_init__(self) -> None:
        """Refuse a part that the job does not have."""
        if not 1 <= self.number <= self.count:
            raise ValueError(f"{self.number}/{self.count} is no part; of {self.count} parts give 1 to {self.count}")

    def __str__(self) -> str:
        """The part as it is typed."""
        return f"{self.number}/{self.count}"

    @classmethod
    def parse(cls, text: "str | Part") -> "Part":
        """Read a part such as "3/64"; a `Part` is returned as it is.

        Raises:
            ValueError: The text is no part.

        Example:
            >>> Part.parse("3/64")
            Part(number=3, count=64)
        """
        if isinstance(text, Part):
            return text
        match = re.fullmatch(r"\s*(\d+)\s*/\s*(\d+)\s*", text, re.ASCII) if isinstance(text, str) else None
        if match is None:
            raise ValueError(f"{text!r} is no part of a job; write its number, from 1, and the number of parts: 3/64")
        number, count = map(int, match.groups())
        if not 1 <= number <= count:
            hint = "the first part is 1, not 0" if number == 0 else f"parts are 1/{count} to {count}/{count}"
            raise ValueError(f"{text} is no part of a job; {hint if count else 'a job has one part at least: 1/1'}")
        return cls(number, count)

    def share(self, items: int, unit: int = 1) -> range:
        """Consecutive items of this part; the parts of a job hold each item once.

        Args:
            items: Number of items of the job.
            unit: Items that stay together, the first `unit` of them first [1].

        Returns:
            Numbers of the items, from 0; empty where there are fewer units than parts.

        Example:
            >>> [Part(k, 3).share(10, unit=2) for k in (1, 2, 3)]
            [range(0, 2), range(2, 6), range(6, 10)]
        """
        units = -(-items // unit)
        first, last = (units * number // self.count * unit for number in (self.number - 1, self.number))
        return range(min(first, items), min(last, items))
