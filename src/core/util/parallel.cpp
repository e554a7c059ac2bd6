// Compiled without ThreadSanitizer, like TBB itself: half of TBB's task scheduler consists of templates,
// which would be instrumented here, unlike the other half.
#include "core/util/parallel.h"

#include <tbb/parallel_for.h>

namespace strobe {

void runTasks(size_t count, void (*body)(void* context, size_t i), void* context) {
    tbb::parallel_for(
        tbb::blocked_range<size_t>(0, count, 1),
        [=](const tbb::blocked_range<size_t>& range) { body(context, range.begin()); },
        tbb::simple_partitioner{});
}

} // namespace strobe
