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

/// Everything that robots told, in the order it came, numbered from 0: each page is sent all of it,
/// whenever it opens, so that it can show any time of the past.
///
/// What takes more than the limit goes: first images that a newer one has followed, then meshes
/// that a newer version has replaced, keyframe poses likewise, poses, and states of the past, of
/// each the oldest first. What counts now, and closures, stay; if they alone are more than the
/// limit, what comes then is refused.
///
/// Robots tell the past again when somebody else comes to watch: what says nothing new is left out.
/// Thread-safe.
class ViewStore {
 public:
  explicit ViewStore(std::size_t max_bytes) : max_bytes_(max_bytes) {}

  void add(ViewUpdate update);

  /// How far a page has been told.
  struct Cursor {
    std::uint64_t next = 0;                ///< Number of the message to come.
    std::optional<std::size_t> forgotten;  ///< Absent in a page that knows nothing yet.
  };
  struct Batch {
    std::vector<std::shared_ptr<const PageMessage>> messages;
    std::vector<std::uint64_t> forgotten;  ///< Numbers of messages that it had and that are gone.
    bool caught_up = false;                ///< There is no more for now.
  };
  /// What comes after `cursor`, which is moved on, up to about `max_bytes`; waits up to `wait_s`
  /// until there is any.
  [[nodiscard]] Batch take(Cursor& cursor, std::size_t max_bytes, double wait_s);

  struct Size {
    std::size_t messages = 0;
    std::size_t bytes = 0;
    std::size_t forgotten = 0;  ///< Messages let go for want of memory.
    std::size_t refused = 0;    ///< Messages not taken for want of memory.
  };
  [[nodiscard]] Size size() const;

 private:
  using Key = std::array<std::int64_t, 7>;  // what a newer message with the same one replaces
  struct Newest {
    std::uint64_t number = 0;  // of the message
    std::size_t hash = 0;      // of its content
  };

  static std::optional<Key> key_of(const ViewUpdate& update);
  void note_boot(const ViewUpdate& update);
  bool is_known(const std::optional<Key>& key, std::size_t hash) const;
  bool leave_new_closures(RobotId robot, ViewClosures& all);
  void supersede(const Key& key, const Newest& newest);
  void forget_until_it_fits();
  void drop(std::uint64_t number);

  const std::size_t max_bytes_;
  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable added_;
  std::vector<std::shared_ptr<const PageMessage>> messages_;  // null: forgotten
  std::vector<std::uint64_t> forgotten_;
  std::size_t bytes_ = 0;
  std::size_t refused_ = 0;
  std::map<RobotId, std::uint64_t> boots_;
  std::map<Key, Newest> newest_;
  std::map<RobotId, std::map<ClosureId, ViewClosure>> closures_;  // as told last
  std::array<std::deque<std::uint64_t>, 5> superseded_;           // in the order in which they go
};

}  // namespace km
