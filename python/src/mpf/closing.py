# SPDX-License-Identifier: MIT
"""What `with` and `async with` do with objects that have a close()."""

from __future__ import annotations

from abc import abstractmethod
from types import TracebackType
from typing import TypeVar

Self = TypeVar("Self")


class Closing:
    def __enter__(self: Self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    @abstractmethod
    def close(self) -> None: ...


class AsyncClosing:
    async def __aenter__(self: Self) -> Self:
        return self

    async def __aexit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    @abstractmethod
    def close(self) -> None: ...
