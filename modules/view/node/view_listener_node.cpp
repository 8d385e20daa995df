#include "modules/view/node/view_listener_node.hpp"

#include <algorithm>
#include <utility>

#include "runtime/clock.hpp"

namespace km {
namespace {

// Robots keep sending to a dead viewer until this lease ends.
constexpr double kLease_s = 10.0;

std::shared_ptr<const DdsDomain> join(DdsConfig config) {
  config.lease_s = std::min(config.lease_s, kLease_s);
  return std::make_shared<const DdsDomain>(config);
}

void wait_for(const DdsEntity& waitset, dds_entity_t entity) {
  check_dds(dds_waitset_attach(waitset.handle(), entity, 0), "cannot wait for updates");
}

void wait_for(const DdsEntity& waitset, const ViewReader& reader) {
  check_dds(dds_set_status_mask(reader.handle(), DDS_DATA_AVAILABLE_STATUS),
            "cannot wait for data");
  wait_for(waitset, reader.handle());
}

}  // namespace

ViewListener::ViewListener(DdsConfig config) : ViewListener(join(std::move(config))) {}

ViewListener::ViewListener(std::shared_ptr<const DdsDomain> domain)
    : domain_(std::move(domain)),
      participant_(dds_create_participant(static_cast<dds_domainid_t>(domain_->config().domain),
                                          nullptr, nullptr),
                   "DDS participant of a viewer"),
      image_topic_(create_view_topic(participant_.handle(), ViewChannel::kImages)),
      view_topic_(create_view_topic(participant_.handle(), ViewChannel::kView)),
      mesh_topic_(create_view_topic(participant_.handle(), ViewChannel::kMesh)),
      wake_(dds_create_guardcondition(participant_.handle()), "guard condition"),
      view_(participant_.handle(), view_topic_.handle(), ViewChannel::kView),
      mesh_(participant_.handle(), mesh_topic_.handle(), ViewChannel::kMesh),
      waitset_(dds_create_waitset(participant_.handle()), "waitset") {
  wait_for(waitset_, wake_.handle());
  wait_for(waitset_, view_);
  wait_for(waitset_, mesh_);
}

std::optional<ViewUpdate> ViewListener::next(double patience_s) {
  const double end_s = steady_now_s() + patience_s;
  while (taken_.empty()) {
    follow_requests();
    take_all();
    const double left_s = end_s - steady_now_s();
    if (!taken_.empty() || stopped_ || left_s <= 0.0) break;
    check_dds(dds_waitset_wait(waitset_.handle(), nullptr, 0, nanoseconds(left_s)),
              "cannot wait for updates");
  }
  if (taken_.empty() || stopped_) return std::nullopt;
  ViewUpdate update = std::move(taken_.front());
  taken_.pop_front();
  return update;
}

// Small updates come first, so that they do not wait behind a mesh.
void ViewListener::take_all() {
  const double now_s = steady_now_s();
  const auto count = [this](ViewUpdate update) { taken_.push_back(std::move(update)); };
  const auto keep = [&](ViewUpdate update) { incumbents_.add(std::move(update), now_s, count); };
  refused_ += view_.take(keep);
  for (auto& [robot, reader] : images_) refused_ += reader.take(keep);
  refused_ += mesh_.take(keep);
  incumbents_.serve(now_s, count);
}

// Resets the guard condition before it reads the requests, so that a later request or stop() wakes
// the thread again.
void ViewListener::follow_requests() {
  dds_set_guardcondition(wake_.handle(), false);
  const std::set<RobotId> asked = [&] {
    const std::lock_guard lock(mutex_);
    return asked_;
  }();
  std::erase_if(images_, [&](const auto& entry) {
    if (asked.contains(entry.first)) return false;
    dds_waitset_detach(waitset_.handle(), entry.second.handle());
    return true;
  });
  for (const RobotId robot : asked) {
    const auto [reader, is_new] = images_.try_emplace(
        robot, participant_.handle(), image_topic_.handle(), ViewChannel::kImages, robot);
    if (is_new) wait_for(waitset_, reader->second);
  }
}

void ViewListener::ask_for_images(const std::set<RobotId>& robots) {
  {
    const std::lock_guard lock(mutex_);
    asked_ = robots;
  }
  dds_set_guardcondition(wake_.handle(), true);
}

void ViewListener::stop() noexcept {
  stopped_ = true;
  dds_set_guardcondition(wake_.handle(), true);
}

}  // namespace km
