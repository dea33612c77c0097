"""Fast reverberation: the expected seabed echo of one ping, point by point along radials of the sonar.

The eigenray engine evaluates legs, pairs and scattering strengths of a batch of points one array after the other; here
a radial is evaluated in one pass through all of them, point by point, and tables that the next ping needs are kept.
`prepare_fast_reverberation` returns None where its conditions do not hold (one ray of each family to a point, a
monostatic sonar with one beam a side, a short pulse, still water, a smooth surface); then the eigenray engine evaluates
the seabed. Otherwise it returns a `FastReverberation`, whose `accumulate` gives blocks of `ReverberationSamples` to a
function and returns its sums. Reflection products, scattering laws, terrain, beams and families are those of the
eigenray engine.
"""

from insonify.engines.fast_reverberation.reverberation import FastReverberation, prepare_fast_reverberation

__all__ = ["FastReverberation", "prepare_fast_reverberation"]
