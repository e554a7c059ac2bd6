// Loops whose turns run side by side.
#pragma once

#include <atomic>
#include <cstddef>

namespace strobe {

/// What the turns of a loop share. TBB orders what is before, in and after its tasks; this says so in the
/// language, too, since ThreadSanitizer does not see into TBB.
template <class Turn>
class ParallelTurns {
  public:
    explicit ParallelTurns(const Turn& turn) : m_turn(turn) { m_order.store(1, std::memory_order_release); }
    ~ParallelTurns() { m_order.load(std::memory_order_acquire); }
    ParallelTurns(const ParallelTurns&) = delete;
    ParallelTurns& operator=(const ParallelTurns&) = delete;

    static void run(void* turns, size_t i) {
        ParallelTurns& self = *static_cast<ParallelTurns*>(turns);
        self.m_order.load(std::memory_order_acquire);
        const Leaving leaving{self.m_order};
        self.m_turn(i);
    }

  private:
    struct Leaving { ///< also by an exception
        std::atomic<size_t>& order;
        ~Leaving() { order.fetch_add(1, std::memory_order_release); }
    };
    const Turn& m_turn;
    std::atomic<size_t> m_order{0};
};

/// Calls `turn(context, i)` for all i below `count`, each as a task of TBB's.
void runTasks(size_t count, void (*turn)(void* context, size_t i), void* context);

/// Calls `turn(i)` for all i below `count`, from the threads of the current TBB arena; returns when all are
/// done. An exception of one ends the loop and is passed on: others may be left out.
template <class Turn>
void parallelFor(size_t count, const Turn& turn) {
    ParallelTurns<Turn> turns(turn);
    runTasks(count, ParallelTurns<Turn>::run, &turns);
}

} // namespace strobe
