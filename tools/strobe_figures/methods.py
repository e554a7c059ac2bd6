"""Methods: integrators with parameters, as figures name and draw them.

The integrator of a method sets its color and its marker in every figure. Parameters that differ from the defaults set the
dashes of its line and make its markers hollow.
"""

import dataclasses


@dataclasses.dataclass(frozen=True)
class Method:
    """An integrator with its parameters: one curve of a chart."""

    name: str
    integrator: str
    defines: tuple = ()  # "name=value", as given to -D
    sample_factor: int = 0  # samples per pixel relative to supersample's; 0: the default of the integrator

    @property
    def variant(self):
        """The index of the dashes: 0 for default parameters, 1 to 4 for others."""
        return max((_VARIANTS.get(d, _VARIANTS.get(d.split("=")[0], 0)) for d in self.defines), default=0)

    def style(self):
        """Members of a chart's series that select color, marker and dashes."""
        return {"integrator": self.integrator, "variant": self.variant}


_VARIANTS = {"timebins": 1, "lightsamples": 1, "blocksize": 2, "shades": 3, "scope=tile": 2, "scope=thread": 4,
             "scope=mutex": 4}

SUPERSAMPLE = Method("supersample", "supersample")
SUPERSAMPLE_1_LIGHT = Method("supersample, 1 light sample", "supersample", ("lightsamples=1",))
MSAA = Method("msaa", "msaa")
MSAA_CACHE = Method("msaa-cache", "msaa-cache")
MSAA_CACHE_1_BIN = Method("msaa-cache, 1 time bin", "msaa-cache", ("timebins=1",))
MSAA_CACHE_HALF_BLOCKS = Method("msaa-cache, blocks of 0.5 px", "msaa-cache", ("blocksize=0.5",))
MSAA_CACHE_QUARTER_BLOCKS = Method("msaa-cache, blocks of 0.25 px", "msaa-cache", ("blocksize=0.25",))
MSAA_CACHE_4_SHADES = Method("msaa-cache, 4 shades per point", "msaa-cache", ("shades=4",))
CACHE_PER_TILE = Method("msaa-cache, cache per tile", "msaa-cache", ("scope=tile",))
CACHE_PER_THREAD = Method("msaa-cache, cache per thread (paper)", "msaa-cache", ("scope=thread",))
CACHE_BEHIND_MUTEX = Method("msaa-cache, cache behind a mutex (paper)", "msaa-cache", ("scope=mutex",))
INDIRECT_CACHE = Method("indirect-cache", "indirect-cache")
INDIRECT_CACHE_1_LIGHT = Method("indirect-cache, 1 light sample", "indirect-cache", ("lightsamples=1",))
ADAPTIVE_CACHE = Method("adaptive-cache", "adaptive-cache")
ADAPTIVE_CACHE_1_LIGHT = Method("adaptive-cache, 1 light sample", "adaptive-cache", ("lightsamples=1",))
CYCLES = Method("Blender Cycles", "cycles")

BASELINES = (SUPERSAMPLE, SUPERSAMPLE_1_LIGHT)
