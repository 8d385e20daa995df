#pragma once

#include <cstdint>
#include <mutex>
#include <string>
#include <utility>

#include "modules/security/team_seal.hpp"

namespace km {

/// The seal of this process for all threads of the transport, one at a time. Each thread waits for
/// at most one message per other thread to be sealed or opened. Thread-safe.
class SharedSeal {
 public:
  /// See TeamSeal.
  SharedSeal(RobotKeys keys, const RobotIdentity& own, std::int64_t now_s)
      : seal_(std::move(keys), own, now_s), credentials_(seal_.credentials()) {}

  /// Returns the result of `use(TeamSeal&)`, by value. `use` must not call anything that waits.
  template <typename Use>
  auto with(const Use& use) {
    const std::lock_guard lock(mutex_);
    return use(seal_);
  }

  /// TeamSeal::credentials(), which never change.
  [[nodiscard]] const std::string& credentials() const { return credentials_; }

 private:
  std::mutex mutex_;  // guards seal_
  TeamSeal seal_;
  const std::string credentials_;
};

}  // namespace km
