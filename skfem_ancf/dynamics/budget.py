"""What is left of the tolerance of a motion, by the error that its steps were seen to add."""

from __future__ import annotations

#: Part of ``rtol`` up to which an error is let be, as it is right to a tenth or so, the part that
#: is aimed at once it was above, and those between which nothing is changed on the way.
ENOUGH, AIM, LEAST, MOST = 0.9, 0.6, 0.4, 0.75
#: Parts of the motion after which it is looked at the error, and the first of them.
LOOKS, FIRST = 16, 2
#: Error over estimate that is taken before any is seen, the error that this counts for, and the
#: estimate up to which nothing is seen: what is at rest tells nothing of a blow that comes.
GAIN, UNSEEN, REST = 1.2, 0.1, 0.015
#: Part of its share that a step has at least in the mean: those at the start are shorter.
FILLED = 0.4
#: By how much a share may grow, in all and in a motion that is taken again, by how much it may
#: shrink, as errors of vibrations are there early and grow no more, and by how much at once.
WIDEST, AGAIN, NARROWEST, FASTEST = 8.0, 2.0, 0.4, 2.0


class Budget:
    """Scales what steps may add to the error by what others have added.

    Parameters
    ----------
    t_start, span
        Time at the start, and length of the motion.
    gain, share
        Of a motion that was taken before: its error over its estimate, and the share that does.

    Attributes
    ----------
    share
        What a step may add, over its part of ``rtol`` in proportion to its size.
    """

    def __init__(self, t_start: float, span: float, gain: float = GAIN,
                 share: float | None = None) -> None:
        self.t_start, self.span, self._gain = t_start, span, gain
        self.share = 1.0 if share is None else share
        self._most = WIDEST if share is None else AGAIN * share
        self._least = NARROWEST * self.share
        self._added = self._filled = 0.0
        self._next = FIRST

    def add(self, error: float, dt: float) -> None:
        """A step is done.

        Parameters
        ----------
        error
            What it adds to the error, as estimated, over its share.
        dt
            Its size.
        """
        self._filled += error * dt / self.span
        self._added += self.share * error * dt / self.span

    def due(self, t: float) -> bool:
        """True if it is time to look at the error.

        Parameters
        ----------
        t
            Time.
        """
        return LOOKS * (t - self.t_start) >= self._next * self.span

    def learn(self, t: float, error: float) -> float:
        """Change the share by the error that there is; by how much.

        Parameters
        ----------
        t
            Time.
        error
            The largest of the motion so far, over ``rtol``.
        """
        done, before = (t - self.t_start) / self.span, self.share
        self._next = int(LOOKS * done) + 1
        gain = (error + UNSEEN) / (self._added + UNSEEN / self._gain)
        ahead = gain * (1.0 - done) * max(FILLED, self._filled / done) * before
        if self._added > REST and error < ENOUGH and ahead > 0.0:
            wanted = max(ahead, LEAST - error)
            wanted = min(wanted, max(MOST - error, 0.5 * (ENOUGH - error)))
            share = before * min(FASTEST, max(1.0 / FASTEST, wanted / ahead))
            self.share = min(self._most, max(self._least, share))
        return self.share / before

    def again(self, error: float) -> Budget:
        """That of the motion taken once more.

        Parameters
        ----------
        error
            Of the whole motion, over ``rtol``.
        """
        if not self._added > 0.0:  # no step has estimated any
            return Budget(self.t_start, self.span, self._gain, AIM * self.share / error)
        mean = self._added / self._filled
        return Budget(self.t_start, self.span, error / self._added, AIM * mean / error)


__all__ = ["Budget"]
