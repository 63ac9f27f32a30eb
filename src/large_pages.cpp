#include "large_pages.h"

#include <malloc.h>
#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <cstdlib>
#include <new>

namespace {

/// The end of the heap at the last request.
std::atomic<void*> asked_up_to{nullptr};

/// Requests large pages for the part by which the heap has grown.
void ask_for_large_pages() {
  void* const end = sbrk(0);
  void* const begin = asked_up_to.exchange(end);
  if (begin != nullptr && begin < end) {
    // A kernel that has none refuses, and nothing else changes.
    madvise(begin, static_cast<std::size_t>(static_cast<char*>(end) - static_cast<char*>(begin)), MADV_HUGEPAGE);
  }
}

}  // namespace

namespace pellicle {

void use_large_pages() {
  constexpr int growth = 64 << 20;  // [bytes] of addresses; memory only once they are used
  mallopt(M_TOP_PAD, growth);
  mallopt(M_MMAP_MAX, 0);         // All blocks lie in the heap,
  mallopt(M_TRIM_THRESHOLD, -1);  // which never shrinks.
}

}  // namespace pellicle

// Not inlined: gcc would take free() in the place of a delete for a mistake. What C libraries allocate is asked for
// with the next block of C++, and mostly lies in what the heap has grown by before.
[[gnu::noinline]] void* operator new(std::size_t size) {
  void* const block = std::malloc(size > 0 ? size : 1);
  if (block == nullptr) {
    throw std::bad_alloc();
  }
  if (sbrk(0) != asked_up_to.load(std::memory_order_relaxed)) {
    ask_for_large_pages();
  }
  return block;
}

[[gnu::noinline]] void operator delete(void* block) noexcept { std::free(block); }
[[gnu::noinline]] void operator delete(void* block, std::size_t) noexcept { std::free(block); }
