#pragma once

#include <optional>
#include <utility>

namespace km {

/// Result of decoding untrusted bytes: a value, or the reason for its absence (a string literal).
template <typename T>
struct [[nodiscard]] Decoded {
  std::optional<T> value;
  const char* refusal = nullptr;

  static Decoded accept(T decoded) { return {std::move(decoded), nullptr}; }
  static Decoded refuse(const char* why) { return {std::nullopt, why}; }
};

}  // namespace km
