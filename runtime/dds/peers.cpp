#include "runtime/dds/peers.hpp"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "runtime/clock.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

constexpr std::uint32_t kNews =
    DDS_NOT_READ_SAMPLE_STATE | DDS_ANY_VIEW_STATE | DDS_ANY_INSTANCE_STATE;
// Robots of a team with keys are unknown senders for about a second, until they exchange their
// keys.
constexpr double kStrange_s = 3.0;
constexpr double kAnnouncementPeriod_s = 5.0;  // shortest interval between announcements in the
                                               // status topic
// Time without any robot after which a robot renews its participant [s]: far above the time of
// discovery, first often, because an attack is short, then rarely.
constexpr double kIsolated_s = 15.0;
constexpr double kIsolatedLater_s = 60.0;
constexpr int kOftenRenewed = 6;
// Samples of one call. A call that lends samples writes as many pointers as the largest loan of its
// reader had, also for fewer samples.
constexpr std::uint32_t kBatch = 16;
constexpr std::size_t kMaxEvents = 1024;  // maximum number of waiting events, because any
                                          // participant can cause them

std::optional<Guid> take_participant(dds_builtintopic_endpoint_t* endpoint) {
  if (endpoint == nullptr) return std::nullopt;
  const Guid guid = to_guid(endpoint->participant_key);
  dds_builtintopic_free_endpoint(endpoint);
  return guid;
}

// Keeps only printable characters, because people read the announcements of unknown participants.
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

std::optional<Guid> participant_of_subscription(dds_entity_t writer, dds_instance_handle_t reader) {
  return take_participant(dds_get_matched_subscription_data(writer, reader));
}

void WriterBook::listen(dds_listener_t* listener) {
  dds_lset_subscription_matched_arg(listener, &WriterBook::on_matched, this, true);
}

std::optional<Guid> WriterBook::participant_of(dds_instance_handle_t writer) const {
  const std::lock_guard lock(mutex_);
  const auto found = participant_of_.find(writer);
  return found == participant_of_.end() ? std::nullopt : std::optional(found->second);
}

// Runs on a thread of DDS, once per change.
void WriterBook::on_matched(dds_entity_t reader, dds_subscription_matched_status_t status,
                            void* self) {
  auto& book = *static_cast<WriterBook*>(self);
  const dds_instance_handle_t writer = status.last_publication_handle;
  if (status.current_count_change > 0) {
    const auto guid = take_participant(dds_get_matched_publication_data(reader, writer));
    const std::lock_guard lock(book.mutex_);
    if (guid) book.participant_of_.emplace(writer, *guid);
    return;
  }
  constexpr std::size_t kMaxGone = 4096;  // bound on removed writers whose last messages may still
                                          // be waiting
  const std::lock_guard lock(book.mutex_);
  book.gone_.push_back(writer);
  if (book.gone_.size() <= kMaxGone) return;
  book.participant_of_.erase(book.gone_.front());
  book.gone_.pop_front();
}

Topic<PeerEvent>::Message EventReceipts::track(PeerEvent event) {
  const auto take_back = [self = shared_from_this()](const PeerEvent* handled) {
    const std::unique_ptr<const PeerEvent> owner(handled);
    const std::lock_guard lock(self->mutex_);
    self->handled_.push_back({handled->identity.robot, handled->identity.boot});
  };
  return {new PeerEvent(std::move(event)), take_back};
}

std::vector<TeamPeer> EventReceipts::take() {
  const std::lock_guard lock(mutex_);
  return std::exchange(handled_, {});
}

Peers::Peers(const DdsParticipant& participant)
    : participant_(participant),
      seal_(participant.seal()),
      table_(
          participant.identity(),
          seal_ == nullptr
              ? PeerTable::Admit()
              : [this](const auto& identity,
                       std::string_view credentials) { return admit(identity, credentials); }),
      announcer_(
          kMaxEvents, Overflow::kDropOldest, [this](const auto& event) { events_.publish(event); },
          "peer_events") {
  open();
}

void Peers::open() {
  const dds_entity_t participant = participant_.handle();
  {
    const std::lock_guard lock(mutex_);
    changes_.clear();
    table_.network_changed();
  }
  publish_events();
  liveliness_changed_ = DdsEntity(dds_create_guardcondition(participant), "guard condition");
  reader_ =
      DdsEntity(dds_create_reader(participant, DDS_BUILTIN_TOPIC_DCPSPARTICIPANT, nullptr, nullptr),
                "reader of the participants");
  discovered_ = DdsEntity(dds_create_readcondition(reader_.handle(), kNews), "read condition");
}

// PeerTable calls this function, while the calling member function of Peers holds the mutex.
const char* Peers::admit(const RobotIdentity& identity, std::string_view credentials) {
  if (credentials.empty())
    return "it has no keys, and this robot has those of a team: see kimera_multi_keys and "
           "--security";
  const auto now_s = static_cast<std::int64_t>(wall_now_s());
  if (const char* reason =
          seal_->with([&](TeamSeal& seal) { return seal.admit(identity, credentials, now_s); }))
    return reason;
  admitted_.push_back({identity.robot, identity.boot});
  return nullptr;
}

std::vector<TeamPeer> Peers::take_admitted() {
  const std::lock_guard lock(mutex_);
  return std::exchange(admitted_, {});
}

void Peers::listen(dds_listener_t* listener) {
  dds_lset_liveliness_changed_arg(listener, &Peers::on_liveliness_changed, this, true);
}

Peers::Claim Peers::claim_of(const Guid& guid) const {
  const std::lock_guard lock(mutex_);
  const auto identity = table_.identity_of(guid);
  return {table_.standing(guid), identity ? TeamPeer{identity->robot, identity->boot} : TeamPeer{},
          table_.later_claim_of(guid)};
}

Peers::AnnouncementDue Peers::take_announcement_due(double now_s) {
  const std::lock_guard lock(mutex_);
  if (!table_.receives_strangers())
    strangers_since_s_.reset();
  else if (!strangers_since_s_)
    strangers_since_s_ = now_s;
  const bool asks = strangers_since_s_ && now_s - *strangers_since_s_ >= kStrange_s;
  if ((!asks && askers_.empty()) || now_s < next_announcement_s_) return AnnouncementDue::kNo;
  next_announcement_s_ = now_s + kAnnouncementPeriod_s;
  for (const Guid& guid : std::exchange(askers_, {}))
    if (const auto identity = table_.identity_of(guid); identity && seal_ != nullptr)
      admitted_.push_back({identity->robot, identity->boot});
  return asks ? AnnouncementDue::kAsks : AnnouncementDue::kAnswers;
}

bool Peers::take_isolation(double now_s) {
  const std::lock_guard lock(mutex_);
  if (!table_.is_isolated()) {
    isolated_since_s_.reset();
    return false;
  }
  if (!isolated_since_s_) isolated_since_s_ = now_s;
  const double patience_s = renewals_ < kOftenRenewed ? kIsolated_s : kIsolatedLater_s;
  if (now_s - *isolated_since_s_ < patience_s) return false;
  isolated_since_s_.reset();
  ++renewals_;
  return true;
}

void Peers::announced(const Guid& guid, std::string_view user_data, bool asks) {
  tell(&PeerTable::participant, guid, user_data, std::string());
  const std::lock_guard lock(mutex_);
  if (asks && askers_.size() < PeerTable::kMaxParticipants) askers_.insert(guid);
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

void Peers::poll() {
  take_discovered();
  take_liveliness();
  {
    const std::lock_guard lock(mutex_);
    for (const TeamPeer& restarted : receipts_->take()) table_.restart_handled(restarted);
  }
  publish_events();
}

// Announcements stay in the reader: see announce().
void Peers::take_discovered() {
  bool has_gone = false;
  while (true) {
    std::array<void*, kBatch> samples{};
    std::array<dds_sample_info_t, kBatch> infos{};
    const dds_return_t count = check_dds(
        dds_read_mask(reader_.handle(), samples.data(), infos.data(), kBatch, kBatch,
                      DDS_NOT_READ_SAMPLE_STATE | DDS_ANY_VIEW_STATE | DDS_ANY_INSTANCE_STATE),
        "cannot discover");
    if (count == 0) break;
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
      const auto& sample = *static_cast<const dds_builtintopic_participant_t*>(samples[i]);
      if (to_guid(sample.key) == participant_.guid()) continue;
      has_gone |= infos[i].instance_state != DDS_IST_ALIVE;
      take(sample, infos[i]);
    }
    dds_return_loan(reader_.handle(), samples.data(), count);
  }
  if (has_gone) remove_gone();
}

void Peers::take(const dds_builtintopic_participant_t& sample, const dds_sample_info_t& info) {
  const std::lock_guard lock(mutex_);
  if (info.instance_state != DDS_IST_ALIVE)
    table_.participant_gone(to_guid(sample.key));
  else if (info.valid_data)
    table_.participant(to_guid(sample.key), user_data_of(sample.qos), addresses_of(sample.qos));
}

// Removes the announcements of participants that have gone from the reader.
void Peers::remove_gone() {
  std::array<void*, kBatch> samples{};
  std::array<dds_sample_info_t, kBatch> infos{};
  dds_return_t count = 0;
  do {
    count = check_dds(dds_take_mask(reader_.handle(), samples.data(), infos.data(), kBatch, kBatch,
                                    DDS_READ_SAMPLE_STATE | DDS_ANY_VIEW_STATE |
                                        DDS_NOT_ALIVE_DISPOSED_INSTANCE_STATE |
                                        DDS_NOT_ALIVE_NO_WRITERS_INSTANCE_STATE),
                      "cannot discover");
    dds_return_loan(reader_.handle(), samples.data(), count);
  } while (count > 0);
}

// Reads the announcement of a participant again that the table has discarded in favour of others.
void Peers::announce(const Guid& guid) {
  dds_builtintopic_participant_t key{};
  std::ranges::copy(guid, key.key.v);
  const dds_instance_handle_t instance = dds_lookup_instance(reader_.handle(), &key);
  std::array<void*, kBatch> samples{};
  dds_sample_info_t info{};
  if (instance == DDS_HANDLE_NIL ||
      dds_read_instance(reader_.handle(), samples.data(), &info, 1, 1, instance) <= 0)
    return;
  take(*static_cast<const dds_builtintopic_participant_t*>(samples[0]), info);
  dds_return_loan(reader_.handle(), samples.data(), 1);
}

void Peers::take_liveliness() {
  bool triggered = false;
  dds_take_guardcondition(liveliness_changed_.handle(), &triggered);
  std::deque<LivelinessChange> changes;
  {
    const std::lock_guard lock(mutex_);
    changes.swap(changes_);
  }
  // A writer may be reported alive a moment before it is matched: try again.
  constexpr int kMaxAttempts = 20;
  std::deque<LivelinessChange> again;
  for (LivelinessChange& change : changes)
    if (!apply(change) && ++change.attempts < kMaxAttempts) again.push_back(change);
  const std::lock_guard lock(mutex_);
  changes_.insert(changes_.begin(), again.begin(), again.end());
}

// False if the writer's participant is not known yet.
bool Peers::apply(const LivelinessChange& change) {
  const auto guid = status_writers_->participant_of(change.writer);
  if (!guid) return false;
  std::unique_lock lock(mutex_);
  if (change.alive + change.not_alive < 0) {
    // A silent writer that is closed by DDS has expired: its robot stays lost.
    if (change.alive < 0) table_.closed(*guid);
  } else if (change.alive > 0) {
    table_.alive(*guid);
    if (table_.is_announced(*guid)) return true;
    lock.unlock();
    announce(*guid);
  } else if (change.alive < 0) {
    table_.silent(*guid);
  }
  return true;
}

void Peers::publish_events() {
  std::vector<PeerEvent> events;
  {
    const std::lock_guard lock(mutex_);
    events = table_.take_events();
  }
  for (PeerEvent& event : events) {
    log_event(event);
    const bool restarted = event.kind == PeerEventKind::kRestarted;
    announcer_.post(restarted ? receipts_->track(std::move(event))
                              : std::make_shared<const PeerEvent>(std::move(event)));
  }
}

}  // namespace km
