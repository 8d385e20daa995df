#include "apps/viewer/view_store.hpp"

#include <chrono>
#include <functional>
#include <string>

namespace km {
namespace {

// Ranks of messages that may be dropped. The lowest rank is dropped first. The second number of a
// key is the rank.
constexpr std::int64_t kImage = 0, kMesh = 1, kLayer = 2, kKeyframes = 3, kPose = 4, kState = 5;

// True for mesh chunks, objects, rasters and keyframe poses. Robots repeat them unchanged, and the
// store ignores the repetitions. Poses, states and images are never ignored.
bool may_be_repetition(const auto& key) {
  return key && ((*key)[1] == kMesh || (*key)[1] == kLayer || (*key)[1] == kKeyframes);
}

// Hash of the update without its time of sending.
std::size_t hash_of(ViewUpdate update) {
  update.sent = 0;
  return std::hash<std::string>{}(page_message(update, 0).bytes);
}

}  // namespace

std::optional<ViewStore::Key> ViewStore::key_of(const ViewUpdate& update) {
  const std::int64_t robot = update.robot;
  if (std::holds_alternative<ViewImage>(update.content)) return Key{robot, kImage};
  if (std::holds_alternative<ViewObjects>(update.content)) return Key{robot, kLayer};
  if (std::holds_alternative<ViewRaster>(update.content)) return Key{robot, kLayer, 1};
  if (std::holds_alternative<ViewPose>(update.content)) return Key{robot, kPose};
  if (std::holds_alternative<RobotSample>(update.content)) return Key{robot, kState};
  if (const auto* const chunk = std::get_if<MeshChunk>(&update.content))
    return Key{robot,
               kMesh,
               chunk->key.robot,
               chunk->key.cell[0],
               chunk->key.cell[1],
               chunk->key.cell[2],
               chunk->key.part};
  if (const auto* const keyframes = std::get_if<ViewKeyframes>(&update.content))
    return Key{robot, kKeyframes, keyframes->optimized ? 1 : 0, keyframes->first,
               static_cast<std::int64_t>(keyframes->T_world_kf.size())};
  return std::nullopt;
}

void ViewStore::add(ViewUpdate update) {
  const auto key = key_of(update);
  const std::size_t hash = may_be_repetition(key) ? hash_of(update) : 0;
  const std::lock_guard lock(mutex_);
  note_boot(update);
  if (is_known(key, hash)) return;
  if (auto* const closures = std::get_if<ViewClosures>(&update.content))
    if (!remove_known_closures(update.robot, *closures)) return;
  const std::uint64_t number = messages_.size();
  messages_.push_back(std::make_shared<const PageMessage>(page_message(update, number)));
  bytes_ += messages_.back()->bytes.size();
  if (key) supersede(*key, {number, hash});
  drop_until_it_fits();
  added_.notify_all();
}

// Marks the messages of the robot's earlier process as superseded.
void ViewStore::note_boot(const ViewUpdate& update) {
  const auto [known, is_new] = boots_.emplace(update.robot, update.boot);
  if (is_new || known->second == update.boot) return;
  known->second = update.boot;
  closures_.erase(update.robot);
  const Key first{update.robot};
  auto one = newest_.lower_bound(first);
  while (one != newest_.end() && one->first[0] == update.robot) {
    superseded_[static_cast<std::size_t>(one->first[1])].push_back(one->second.number);
    one = newest_.erase(one);
  }
}

bool ViewStore::is_known(const std::optional<Key>& key, std::size_t hash) const {
  if (!may_be_repetition(key)) return false;
  const auto known = newest_.find(*key);
  return known != newest_.end() && known->second.hash == hash && messages_[known->second.number];
}

// Removes closures that are known with equal values; false if none is left.
bool ViewStore::remove_known_closures(RobotId robot, ViewClosures& all) {
  auto& known = closures_[robot];
  std::erase_if(all.closures, [&](const ViewClosure& closure) {
    const auto [last, is_new] = known.try_emplace(closure.id, closure);
    if (!is_new && last->second == closure) return true;
    last->second = closure;
    return false;
  });
  return !all.closures.empty();
}

void ViewStore::supersede(const Key& key, const Newest& newest) {
  const auto [known, is_new] = newest_.emplace(key, newest);
  if (is_new) return;
  superseded_[static_cast<std::size_t>(key[1])].push_back(known->second.number);
  known->second = newest;
}

void ViewStore::drop_until_it_fits() {
  for (auto& queue : superseded_)
    while (bytes_ > max_bytes_ && !queue.empty()) {
      if (messages_[queue.front()]) {  // null: the message was refused on arrival
        drop(queue.front());
        forgotten_.push_back(queue.front());
      }
      queue.pop_front();
    }
  if (bytes_ <= max_bytes_) return;
  drop(messages_.size() - 1);
  ++refused_;
}

void ViewStore::drop(std::uint64_t number) {
  bytes_ -= messages_[number]->bytes.size();
  messages_[number].reset();
}

ViewStore::Batch ViewStore::take(Cursor& cursor, std::size_t max_bytes, double wait_s) {
  std::unique_lock lock(mutex_);
  if (!cursor.forgotten) cursor.forgotten = forgotten_.size();
  added_.wait_for(lock, std::chrono::duration<double>(wait_s), [&] {
    return cursor.next < messages_.size() || *cursor.forgotten < forgotten_.size();
  });
  Batch batch;
  for (; *cursor.forgotten < forgotten_.size(); ++*cursor.forgotten)
    if (const std::uint64_t number = forgotten_[*cursor.forgotten]; number < cursor.next)
      batch.forgotten.push_back(number);
  for (std::size_t bytes = 0; cursor.next < messages_.size() && bytes < max_bytes; ++cursor.next)
    if (const auto& message = messages_[cursor.next]) {
      batch.messages.push_back(message);
      bytes += message->bytes.size();
    }
  batch.caught_up = cursor.next == messages_.size();
  return batch;
}

ViewStore::Size ViewStore::size() const {
  const std::lock_guard lock(mutex_);
  return {messages_.size() - forgotten_.size() - refused_, bytes_, forgotten_.size(), refused_};
}

}  // namespace km
