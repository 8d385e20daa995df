#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <type_traits>
#include <vector>

namespace km {

// The sequences of generated types, for all codecs.

/// Points a sequence at `elements`, which it does not own: they outlive it and do not move.
template <typename Sequence, typename T>
void borrow(Sequence& sequence, std::vector<T>& elements) {
  const auto size = static_cast<std::uint32_t>(elements.size());
  sequence = {._maximum = size, ._length = size, ._buffer = elements.data(), ._release = false};
}

/// The elements of a received sequence; nullopt if there are more than `max` or they are missing.
template <typename Sequence>
[[nodiscard]] auto elements_of(const Sequence& sequence, std::size_t max) {
  using Span = std::span<const std::remove_pointer_t<decltype(sequence._buffer)>>;
  const bool usable =
      sequence._length <= max && (sequence._length == 0 || sequence._buffer != nullptr);
  return usable ? std::optional(Span(sequence._buffer, sequence._length)) : std::nullopt;
}

}  // namespace km
