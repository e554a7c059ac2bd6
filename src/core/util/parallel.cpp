// Not compiled with ThreadSanitizer, like TBB itself: half of TBB's tasks are templates, and would be here.
#include "core/util/parallel.h"

#include <tbb/parallel_for.h>

namespace strobe {

void runTasks(size_t count, void (*turn)(void* context, size_t i), void* context) {
    tbb::parallel_for(
        tbb::blocked_range<size_t>(0, count, 1),
        [=](const tbb::blocked_range<size_t>& one) { turn(context, one.begin()); },
        tbb::simple_partitioner{});
}

} // namespace strobe
