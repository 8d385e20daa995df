#pragma once

#include <cstddef>
#include <list>
#include <map>
#include <memory>
#include <utility>

#include "modules/core/keyframe.hpp"

namespace km {

/// Keeps the keyframes used last, at most `capacity`. Not thread-safe.
class KeyframeCache {
 public:
  explicit KeyframeCache(std::size_t capacity) : capacity_(capacity) {}

  void put(std::shared_ptr<const Keyframe> keyframe) {
    const KeyframeId id = keyframe->odometry.id;
    if (const auto old = place_.find(id); old != place_.end()) by_use_.erase(old->second);
    by_use_.push_front(std::move(keyframe));
    place_[id] = by_use_.begin();
    if (by_use_.size() <= capacity_) return;
    place_.erase(by_use_.back()->odometry.id);
    by_use_.pop_back();
  }

  /// Null if it is not (or no longer) there.
  std::shared_ptr<const Keyframe> get(const KeyframeId& id) {
    const auto found = place_.find(id);
    if (found == place_.end()) return nullptr;
    by_use_.splice(by_use_.begin(), by_use_, found->second);
    return by_use_.front();
  }

 private:
  using ByUse = std::list<std::shared_ptr<const Keyframe>>;

  std::size_t capacity_;
  ByUse by_use_;  // latest first
  std::map<KeyframeId, ByUse::iterator> place_;
};

}  // namespace km
