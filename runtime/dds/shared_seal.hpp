#pragma once

#include <envelope.h>

#include <algorithm>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "modules/core/io/bytes.hpp"
#include "modules/security/team_seal.hpp"
#include "runtime/dds/entity.hpp"

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

/// The seal of an envelope's content also covers the topic, the participant that writes it, the
/// envelope's head, and the addressee. So a replayed envelope cannot be opened on another topic or
/// from another participant. `addressee`: none for a message to all.
[[nodiscard]] inline SealContext seal_context(const std::string& topic, const Guid& writer,
                                              const km_wire_Envelope& head,
                                              const std::optional<TeamPeer>& addressee) {
  SealContext context{.topic = topic + '/' + std::string(writer.begin(), writer.end()),
                      .sender = {head.robot, head.boot},
                      .number = head.number,
                      .addressee = addressee};
  ByteWriter key;
  key.u64(head.key);
  key.u16(head.version);
  std::ranges::copy(key.release(), context.key.begin());
  return context;
}

}  // namespace km
