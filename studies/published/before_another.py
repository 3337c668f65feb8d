"""What estimators share that stand before another one and change what it is told."""

from layoutopt.layout import Layout
from layoutopt.protocols import Estimator


class BeforeAnother:
    """An estimator that goes by the name of the one within and applies to the same layouts."""

    __slots__ = ()
    inner: Estimator

    @property
    def name(self) -> str:
        """Name of the estimator within."""
        return self.inner.name

    def applies(self, layout: Layout) -> str:
        """Return why the estimator within cannot work with a layout, or an empty string."""
        return self.inner.applies(layout)
