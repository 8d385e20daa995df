#pragma once

namespace km {

/// Memory that this process has allocated by `new` and not released [B], with the rounding of the
/// allocator. Programs that call this function count in every `new` and `delete`. One thread only.
[[nodiscard]] double counted_heap_bytes();

}  // namespace km
