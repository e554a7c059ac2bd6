// Compiled without ThreadSanitizer, like TBB itself: half of TBB's task scheduler consists of templates,
// which would be instrumented here, unlike the other half.
#include "core/util/parallel.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

namespace strobe {

void runTasks(size_t count, void (*body)(void* context, size_t i), void* context) {
    tbb::parallel_for(
        tbb::blocked_range<size_t>(0, count, 1),
        [=](const tbb::blocked_range<size_t>& range) { body(context, range.begin()); },
        tbb::simple_partitioner{});
}

size_t arenaThreads() { return size_t(tbb::this_task_arena::max_concurrency()); }

size_t arenaThreadIndex() { return size_t(tbb::this_task_arena::current_thread_index()); }

} // namespace strobe
