#include "core/interfaces/filter.h"

namespace strobe {

void Filter::sampleSoA(const V2SoA& u, int n, V2SoA& offset) const {
    for (int i = 0; i < n; ++i)
        offset.set(i, sample(u.at(i)));
}

V2f Filter::sampleNegative(const V2f& /*u*/) const { return V2f(0); }

} // namespace strobe
