// Large blocks of memory.
#pragma once

#include <cstddef>

namespace strobe {

/// Asks the operating system for large pages under a block that was set aside and not yet written: its first
/// writes then cost a hundredth of the page faults. A hint: nothing happens where it is not understood, or
/// does not pay.
void adviseHugePages(void* block, size_t bytes);

/// Gives the operating system back what was freed: the heaps of many threads keep it, in pieces that fit the
/// next time less and less. Milliseconds.
void releaseFreeMemory();

} // namespace strobe
