"""What a small term in a balance does to the innovations: along the base trajectory, linearly."""

from typing import NamedTuple

import numpy as np

from hil_emulator.identify.measured.experiment import Array, Index, Single
from hil_emulator.identify.prediction.linear_period import elapse_linearly, note
from hil_emulator.identify.prediction.records import (
    Data,
    Entries,
    Gains,
    Jacobians,
    ParametrisedModel,
    Start,
)
from hil_emulator.identify.prediction.run import Passage, compare, correct, enter
from hil_emulator.identify.prediction.small_matrices import multiply_eights
from hil_emulator.identify.prediction.transition import Slopes, differentiate, slopes_of


class Changes(NamedTuple):
    """What terms change in one sample, shape (..., terms), their number rounded up to eights.

    Attributes:
        dz: of z.
        after: of z in the next sample.
        dy: of the readings.
        whitened: of the innovations.

    """

    dz: Array
    after: Array
    dy: Array
    whitened: Array


def probe(
    model: ParametrisedModel, data: Data, start: Start, gains: Gains, probes: Index, widths: Array
) -> Entries:
    """Run the frozen predictor and derive each of its steps by the probes.

    Arguments as in `filter.predict`, and:
        probes: parameters whose effect on the next state is wanted.
        widths: steps of the differences by each element of z, then by each of these.

    """
    count, n, m = len(data.current), len(start.z), len(data.chosen)
    entries = Entries(
        np.zeros((count, n, len(probes)), np.float32), np.zeros((count, m, len(probes)), np.float32)
    )
    places = np.zeros(2 + len(probes), np.int64)
    places[0], places[1] = model.drift, model.supply
    for i in range(len(probes)):
        places[2 + i] = probes[i]
    slopes = slopes_of(model, start, data, places, widths)
    try_samples(enter(model, data, start), gains, slopes, entries)
    return entries


def try_samples(passage: Passage, gains: Gains, slopes: Slopes, entries: Entries) -> None:
    """Try each probe in each sample; arguments and results as of `probe`."""
    run, data = passage.run, passage.data
    differentiate(passage, slopes)
    for k in range(len(data.current)):
        passage.sense(*passage.instruments)
        compare(passage, k)
        correct(run, passage.instruments, gains.kalman[k], passage.error)
        elapse_linearly(passage, k, slopes)
        note(slopes, len(run.z), entries.drives[k], entries.feeds[k])


def propagate(
    gains: Gains, jacobians: Jacobians, entry: Entries, inputs: Array, outputs: Array,
    columns: Single,
) -> None:  # fmt: skip
    """Fill a residual's derivatives by small terms that act along the base trajectory.

    All of them at once, in eights.

    Args:
        gains: the frozen gains.
        jacobians: along the base trajectory.
        entry: where the terms enter.
        inputs: what each adds there, shape (samples, terms); without rows, nothing.
        outputs: what each adds to the readings, shape (samples, chosen, terms); without rows,
            nothing.
        columns: derivatives of the whitened innovations, shape (terms, samples, chosen);
            overwritten.

    """
    n, m = gains.kalman.shape[1:]
    width = -(-len(columns) // 8) * 8
    changes = Changes(
        np.zeros((n, width)), np.zeros((n, width)), np.zeros((m, width)), np.zeros((m, width))
    )
    propagate_samples(gains, jacobians, entry, inputs, outputs, changes, columns)


def propagate_samples(
    gains: Gains, jacobians: Jacobians, entry: Entries, inputs: Array, outputs: Array,
    changes: Changes, columns: Single,
) -> None:  # fmt: skip
    """Propagate along all samples; arguments and results as of `propagate`."""
    dz, after, dy, whitened = changes
    n, m, terms = len(dz), len(dy), len(columns)
    drives, feeds = entry.drives, entry.feeds
    for k in range(columns.shape[1]):
        if len(outputs) > 0:
            for i in range(m):
                for t in range(terms):
                    dy[i, t] += outputs[k, i, t]
        multiply_eights(gains.whitening[k].T, dy, -1.0, 0.0, whitened)
        for t in range(terms):
            for i in range(m):
                columns[t, k, i] = whitened[i, t]
        multiply_eights(gains.kalman[k], dy, -1.0, 1.0, dz)
        multiply_eights(jacobians.maps[k], dz, 1.0, 0.0, after)
        multiply_eights(jacobians.senses[k], dz, 1.0, 0.0, dy)
        if len(inputs) > 0:
            for i in range(n):
                for t in range(terms):
                    after[i, t] += drives[k, i] * inputs[k, t]
            for i in range(m):
                for t in range(terms):
                    dy[i, t] += feeds[k, i] * inputs[k, t]
        for i in range(n):
            for t in range(terms):
                dz[i, t] = after[i, t]
