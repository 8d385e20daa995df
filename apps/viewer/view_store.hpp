#pragma once

#include <array>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "apps/viewer/page_message.hpp"
#include "modules/view/view_update.hpp"

namespace km {

/// All messages of the robots in the order of arrival, numbered from 0. Each page receives all of
/// them, so that it can show any time of the past.
///
/// If they exceed the limit, messages are dropped, the oldest of each kind first. The order is
/// images with a newer image, meshes with a newer version, objects and rasters with a newer
/// version, keyframe poses with a newer version, poses, past states. Present states and closures
/// are kept. If they alone exceed the limit, new messages are refused.
///
/// When another viewer starts, robots send past messages again. Messages without new content are
/// ignored. Thread-safe.
class ViewStore {
 public:
  explicit ViewStore(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  void add(ViewUpdate update);

  /// Position of a page in the messages.
  struct Cursor {
    std::uint64_t next = 0;                ///< Number of the next message.
    std::optional<std::size_t> forgotten;  ///< Number of dropped messages that the page knows of.
  };
  struct Batch {
    std::vector<std::shared_ptr<const PageMessage>> messages;
    std::vector<std::uint64_t>
        forgotten;           ///< Numbers of messages that the page has and the store has dropped.
    bool caught_up = false;  ///< True if there are no more messages for now.
  };
  /// Returns messages from `cursor` on, up to about `max_bytes`, and advances `cursor`. Waits up to
  /// `wait_s` for the first message.
  [[nodiscard]] Batch take(Cursor& cursor, std::size_t max_bytes, double wait_s);

  struct Size {
    std::size_t messages = 0;
    std::size_t bytes = 0;
    std::size_t forgotten = 0;  ///< Messages dropped because of the limit.
    std::size_t refused = 0;    ///< Messages refused because of the limit.
  };
  [[nodiscard]] Size size() const;

 private:
  // Key of a message. Older messages with an equal key may be dropped.
  using Key = std::array<std::int64_t, 7>;
  struct Newest {
    std::uint64_t number = 0;  // number of the message
    std::size_t hash = 0;      // hash of its content
  };

  static std::optional<Key> key_of(const ViewUpdate& update);
  void note_boot(const ViewUpdate& update);
  bool is_known(const std::optional<Key>& key, std::size_t hash) const;
  bool remove_known_closures(RobotId robot, ViewClosures& all);
  void supersede(const Key& key, const Newest& newest);
  void drop_until_it_fits();
  void drop(std::uint64_t number);

  const std::size_t max_bytes_;
  mutable std::mutex mutex_;  // guards the members below
  std::condition_variable added_;
  std::vector<std::shared_ptr<const PageMessage>> messages_;  // null: dropped or refused
  std::vector<std::uint64_t> forgotten_;
  std::size_t bytes_ = 0;
  std::size_t refused_ = 0;
  std::map<RobotId, std::uint64_t> boots_;
  std::map<Key, Newest> newest_;
  std::map<RobotId, std::map<ClosureId, ViewClosure>> closures_;  // last received values
  std::array<std::deque<std::uint64_t>, 6> superseded_;  // superseded updates, in the order in
                                                         // which they are dropped
};

}  // namespace km
