#include "runtime/dds/peers.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <string_view>

#include "runtime/log.hpp"

namespace km {
namespace {

Guid to_guid(const dds_guid_t& guid) {
  Guid result{};
  std::ranges::copy(guid.v, result.begin());
  return result;
}

std::optional<Guid> take_participant(dds_builtintopic_endpoint_t* endpoint) {
  if (endpoint == nullptr) return std::nullopt;
  const Guid guid = to_guid(endpoint->participant_key);
  dds_builtintopic_free_endpoint(endpoint);
  return guid;
}

std::string user_data_of(const dds_qos_t* qos) {
  void* data = nullptr;
  std::size_t size = 0;
  if (!dds_qget_userdata(qos, &data, &size) || data == nullptr) return {};
  std::string result(static_cast<const char*>(data), size);
  dds_free(data);
  return result;
}

// What a stranger announces is shown to people: printable characters only.
std::string addresses_of(const dds_qos_t* qos) {
  char* value = nullptr;
  if (!dds_qget_prop(qos, "__NetworkAddresses", &value) || value == nullptr) return {};
  std::string result(value);
  dds_free(value);
  std::erase_if(result, [](char c) { return c < ' ' || c > '~'; });
  return result;
}

void log_event(const PeerEvent& event) {
  switch (event.kind) {
    case PeerEventKind::kConflict:
      log::limited(log::Level::kError, "peers", "conflict") << event.text;
      break;
    case PeerEventKind::kRefused:
      log::limited(log::Level::kWarn, "peers", "refused") << event.text;
      break;
    case PeerEventKind::kLost:
      log::warn("peers") << event.text;
      break;
    default:
      log::info("peers") << event.text;
  }
}

}  // namespace

std::optional<Guid> participant_of_publication(dds_entity_t reader, dds_instance_handle_t writer) {
  return take_participant(dds_get_matched_publication_data(reader, writer));
}

std::optional<Guid> participant_of_subscription(dds_entity_t writer, dds_instance_handle_t reader) {
  return take_participant(dds_get_matched_subscription_data(writer, reader));
}

Peers::Peers(const DdsParticipant& participant)
    : table_(participant.identity(), participant.config().liveliness_s),
      listener_(dds_create_listener(this)),
      liveliness_changed_(dds_create_guardcondition(participant.handle()), "guard condition"),
      reader_(dds_create_reader(participant.handle(), DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, nullptr,
                                nullptr),
              "reader of the participants"),
      discovered_(dds_create_readcondition(reader_.handle(), DDS_ANY_STATE), "read condition") {
  dds_guid_t self{};
  check_dds(dds_get_guid(participant.handle(), &self), "cannot read the participant's identity");
  self_ = to_guid(self);
  dds_lset_liveliness_changed(listener_.get(), &Peers::on_liveliness_changed);
}

Peers::~Peers() = default;

std::vector<Peer> Peers::list() const {
  const std::lock_guard lock(mutex_);
  return table_.peers();
}

std::optional<RobotIdentity> Peers::identity_of(const Guid& guid) const {
  const std::lock_guard lock(mutex_);
  return table_.identity_of(guid);
}

bool Peers::has_met(RobotId robot, std::uint64_t boot) const {
  const std::lock_guard lock(mutex_);
  return table_.has_met(robot, boot);
}

// Runs on a thread of DDS, once per change: only notes it.
void Peers::on_liveliness_changed(dds_entity_t /*reader*/, dds_liveliness_changed_status_t status,
                                  void* self) {
  auto& peers = *static_cast<Peers*>(self);
  {
    const std::lock_guard lock(peers.mutex_);
    peers.changes_.push_back({status.last_publication_handle, status.alive_count_change,
                              status.not_alive_count_change, 0});
  }
  dds_set_guardcondition(peers.liveliness_changed_.handle(), true);
}

void Peers::poll(double now_s) {
  take_discovered(now_s);
  take_liveliness(now_s);
  {
    const std::lock_guard lock(mutex_);
    table_.tick(now_s);
  }
  publish_events();
}

void Peers::take_discovered(double now_s) {
  constexpr std::uint32_t kBatch = 16;
  while (true) {
    std::array<void*, kBatch> samples{};
    std::array<dds_sample_info_t, kBatch> infos{};
    const dds_return_t count =
        check_dds(dds_take(reader_.handle(), samples.data(), infos.data(), kBatch, kBatch),
                  "cannot discover");
    if (count == 0) return;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      const auto& sample = *static_cast<const dds_builtintopic_participant_t*>(samples[i]);
      const Guid guid = to_guid(sample.key);
      if (guid == self_) continue;
      const std::lock_guard lock(mutex_);
      if (infos[i].instance_state != DDS_IST_ALIVE) {
        table_.participant_gone(guid);
      } else if (infos[i].valid_data) {
        table_.participant(guid, user_data_of(sample.qos), addresses_of(sample.qos), now_s);
      }
    }
    dds_return_loan(reader_.handle(), samples.data(), count);
  }
}

void Peers::take_liveliness(double now_s) {
  bool triggered = false;
  dds_take_guardcondition(liveliness_changed_.handle(), &triggered);
  std::deque<LivelinessChange> changes;
  {
    const std::lock_guard lock(mutex_);
    changes.swap(changes_);
  }
  // A writer may be reported alive a moment before its match can be looked up: try again.
  constexpr int kMaxAttempts = 20;
  std::deque<LivelinessChange> again;
  for (LivelinessChange& change : changes)
    if (!apply(change, now_s) && ++change.attempts < kMaxAttempts) again.push_back(change);
  const std::lock_guard lock(mutex_);
  changes_.insert(changes_.begin(), again.begin(), again.end());
}

// False if the writer's participant is not known yet.
bool Peers::apply(const LivelinessChange& change, double now_s) {
  const auto guid = participant_of(change.writer);
  const bool closed = change.alive + change.not_alive < 0;
  if (!guid) return closed;
  const std::lock_guard lock(mutex_);
  if (closed) {
    // A silent writer that is closed by DDS has expired: its robot stays lost.
    if (change.alive < 0) table_.closed(*guid);
    participant_of_writer_.erase(change.writer);
  } else if (change.alive > 0) {
    table_.alive(*guid, now_s);
  } else if (change.alive < 0) {
    table_.silent(*guid);
  }
  return true;
}

std::optional<Guid> Peers::participant_of(dds_instance_handle_t writer) {
  const auto known = participant_of_writer_.find(writer);
  if (known != participant_of_writer_.end()) return known->second;
  const auto guid = participant_of_publication(status_reader_, writer);
  if (guid) participant_of_writer_.emplace(writer, *guid);
  return guid;
}

void Peers::publish_events() {
  std::vector<PeerEvent> events;
  {
    const std::lock_guard lock(mutex_);
    events = table_.take_events();
  }
  for (PeerEvent& event : events) {
    log_event(event);
    events_.publish(std::move(event));
  }
}

}  // namespace km
