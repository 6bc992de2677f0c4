"""Fixtures that tests of the identification share."""

from collections.abc import Iterator

import pytest

from hil_emulator.identify.prediction.observer.observer import Observer


@pytest.fixture(scope="module")
def exact_forms() -> Iterator[None]:
    """Let base laws have the model's form alone, where the mathematics of it is checked."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Observer, "relax", lambda *_: None)
        yield
