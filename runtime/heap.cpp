#include <malloc.h>

// Every program links this file. A robot frees a frame's images, pyramids and depth and then
// allocates those of the next frame. By default glibc returns the freed memory to the kernel at
// once. The next frame faults it in again, page by page: 3000 page faults a frame on EuRoC's MH_01.
// With the settings below a process keeps the memory that it frees, at most its peak.
//
// By default the threads of a process use up to eight heaps per processor, and each heap keeps what
// was freed in it. Different threads make, correct and publish a map, so that its peaks add up over
// the heaps. Here all threads share two heaps. Blocks up to 1 kB have a cache per thread besides.
namespace km {
namespace {

constexpr int kTopPad_bytes = 64 << 20;         // size of a thread's heap, so that glibc trims none
constexpr int kMmapThreshold_bytes = 32 << 20;  // largest value that glibc accepts
constexpr int kTrimThreshold_bytes = 1 << 30;
constexpr int kHeaps = 2;

[[maybe_unused]] const bool keeps_freed_memory = [] {
  return mallopt(M_TOP_PAD, kTopPad_bytes) == 1 &&
         mallopt(M_MMAP_THRESHOLD, kMmapThreshold_bytes) == 1 &&
         mallopt(M_TRIM_THRESHOLD, kTrimThreshold_bytes) == 1 && mallopt(M_ARENA_MAX, kHeaps) == 1;
}();

}  // namespace
}  // namespace km
