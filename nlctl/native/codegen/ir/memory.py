"""Where numbers lie: rows of arrays, one entry per member."""

from __future__ import annotations

from .text import Body, Value, llvm_type


def entry_address(b: Body, array: str, at: int, index: str | None = None, step: int = 1) -> str:
    """Return the address of entry `at` of an array, or of ``index * step + at``."""
    if index is None:
        return b.new(f"getelementptr double, ptr %{array}, i64 {at}").text if at else f"%{array}"
    scaled = b.new(f"mul i64 {index}, {step}").text if step != 1 else index
    moved = b.new(f"add i64 {scaled}, {at}").text if at else scaled
    return b.new(f"getelementptr double, ptr %{array}, i64 {moved}").text


def load_value(b: Body, where: str, width: int) -> Value:
    """Return the number, or as many as a vector has, at an address."""
    return b.new(f"load {llvm_type(width)}, ptr {where}, align 8", width)


def store(b: Body, value: Value, where: str) -> None:
    """Write a number or vector to an address."""
    b.write(f"store {value}, ptr {where}, align 8")
