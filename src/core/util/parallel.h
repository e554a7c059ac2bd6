// Loops whose turns run side by side.
#pragma once

#include <atomic>
#include <cstddef>

namespace strobe {

/// What the turns of a loop share. TBB orders what is before, in and after its tasks; this says so in the
/// language, too, since ThreadSanitizer does not see into TBB.
template <class Body>
class ParallelLoop {
  public:
    explicit ParallelLoop(const Body& turn) : m_body(turn) { m_order.store(1, std::memory_order_release); }
    ~ParallelLoop() { m_order.load(std::memory_order_acquire); }
    ParallelLoop(const ParallelLoop&) = delete;
    ParallelLoop& operator=(const ParallelLoop&) = delete;

    static void run(void* turns, size_t i) {
        ParallelLoop& self = *static_cast<ParallelLoop*>(turns);
        self.m_order.load(std::memory_order_acquire);
        const Leaving leaving{self.m_order};
        self.m_body(i);
    }

  private:
    struct Leaving { ///< also by an exception
        std::atomic<size_t>& order;
        ~Leaving() { order.fetch_add(1, std::memory_order_release); }
    };
    const Body& m_body;
    std::atomic<size_t> m_order{0};
};

/// Calls `turn(context, i)` for all i below `count`, each as a task of TBB's.
void runTasks(size_t count, void (*turn)(void* context, size_t i), void* context);

/// Calls `turn(i)` for all i below `count`, from the threads of the current TBB arena; returns when all are
/// done. An exception of one ends the loop and is passed on: others may be left out.
template <class Body>
void parallelFor(size_t count, const Body& turn) {
    ParallelLoop<Body> turns(turn);
    runTasks(count, ParallelLoop<Body>::run, &turns);
}

} // namespace strobe
