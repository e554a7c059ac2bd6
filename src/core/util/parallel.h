// Parallel loops.
#pragma once

#include "core/math/api.h"

#include <atomic>
#include <cstddef>
#include <memory>
#include <vector>

namespace STROBE_API strobe {

/// The state that the iterations of a parallel loop share: its body, and an atomic variable for
/// ThreadSanitizer. TBB orders the iterations after the code before the loop and before the code after it.
/// ThreadSanitizer does not see this, since TBB is not instrumented, so `m_order` repeats the order as
/// release and acquire operations.
template <class Body>
class ParallelLoop {
  public:
    explicit ParallelLoop(const Body& body) : m_body(body) { m_order.store(1, std::memory_order_release); }
    ~ParallelLoop() { m_order.load(std::memory_order_acquire); }
    ParallelLoop(const ParallelLoop&) = delete;
    ParallelLoop& operator=(const ParallelLoop&) = delete;

    /// Executes iteration i of the ParallelLoop that `loop` points to.
    static void run(void* loop, size_t i) {
        ParallelLoop& self = *static_cast<ParallelLoop*>(loop);
        self.m_order.load(std::memory_order_acquire);
        const ReleaseAtExit release{self.m_order};
        self.m_body(i);
    }

  private:
    struct ReleaseAtExit { ///< a destructor, so that it also runs if the body throws
        std::atomic<size_t>& order;
        ~ReleaseAtExit() { order.fetch_add(1, std::memory_order_release); }
    };
    const Body& m_body;
    std::atomic<size_t> m_order{0};
};

/// Calls `body(context, i)` for all i below `count`, each as a TBB task of its own.
void runTasks(size_t count, void (*body)(void* context, size_t i), void* context);

/// Calls `body(i)` for all i below `count`, on the threads of the current TBB arena, and waits for all calls.
/// If a call throws, the loop is canceled (calls that have not started are skipped) and the exception is
/// rethrown.
template <class Body>
void parallelFor(size_t count, const Body& body) {
    ParallelLoop<Body> loop(body);
    runTasks(count, ParallelLoop<Body>::run, &loop);
}

/// The same for short calls: a task makes some hundreds of them.
template <class Body>
void parallelForRuns(size_t count, const Body& body) {
    constexpr size_t kRun = 256;
    parallelFor((count + kRun - 1) / kRun, [&](size_t run) {
        const size_t end = count - run * kRun < kRun ? count : (run + 1) * kRun;
        for (size_t i = run * kRun; i < end; ++i)
            body(i);
    });
}

/// Returns the number of threads of the current TBB arena, and the index of the calling thread among them.
size_t arenaThreads();
size_t arenaThreadIndex();

/// Objects of the threads of the current TBB arena, each made when its thread first needs it. A thread that
/// waits for a parallel loop may execute iterations of an outer loop: do not keep the reference meanwhile.
template <class T>
class PerThread {
  public:
    PerThread() : m_objects(arenaThreads()) {}
    /// Returns the object of the calling thread. `make` returns a std::unique_ptr to a new one.
    template <class Make>
    T& local(const Make& make) {
        std::unique_ptr<T>& object = m_objects.at(arenaThreadIndex());
        if (!object)
            object = make();
        return *object;
    }
    /// Calls `visit` for each object, in the order of the threads.
    template <class Visit>
    void forEach(const Visit& visit) {
        for (const std::unique_ptr<T>& object : m_objects)
            if (object)
                visit(*object);
    }

  private:
    // Not tbb::enumerable_thread_specific: ThreadSanitizer sees how it frees and reuses memory, but not how
    // TBB orders this.
    std::vector<std::unique_ptr<T>> m_objects;
};

} // namespace strobe
