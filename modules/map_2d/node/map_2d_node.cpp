#include "modules/map_2d/node/map_2d_node.hpp"

#include <algorithm>
#include <utility>

#include "modules/core/io/text_table.hpp"
#include "runtime/clock.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

// Larger than the number of views during the making of any map, so that publishers do not wait.
constexpr std::size_t kQueue = 4096;

constexpr double kPeriod_s = 5.0;  // smallest interval between 2D maps

// Making maps takes at most this share of the time.
constexpr double kShare = 0.2;

}  // namespace

Map2dNode::Map2dNode(const Map2dConfig& config, const LabelPalette& palette, RayThinner thinner,
                     const Map2dTopics& topics)
    : WorkerNode({.name = Map2dConfig::kSection, .queue = kQueue, .in_background = true}),
      config_(checked(config)),
      palette_(palette),
      maps_(topics.maps),
      thinner_(std::move(thinner)) {
  // Thinning takes less than 0.1 ms, so that no image has to wait for a map.
  topics.frames.subscribe([this](const auto& frame) {
    if (auto views = thinner_.add(*frame))
      post(Views(std::make_shared<const ViewRays>(*std::move(views))));
  });
}

void Map2dNode::offer(CorrectedSurface surface) {
  newest_surface_.put(std::make_shared<const CorrectedSurface>(std::move(surface)));
  post(Tick());
}

void Map2dNode::handle(const Input& input) {
  if (const auto* views = std::get_if<Views>(&input)) step(*views);
  if (steady_now_s() >= next_s_ && take_surface()) make_map();
}

void Map2dNode::step(const Views& views) {
  views_.push_back(*views);
  has_new_views_ = true;
  if (views_.size() < kViews) return;
  std::size_t kept = 0;
  for (std::size_t k = 0; k < views_.size(); k += 2) views_[kept++] = std::move(views_[k]);
  views_.resize(kept);
}

bool Map2dNode::take_surface() {
  auto newest = newest_surface_.take();
  if (newest == nullptr) return false;
  surface_ = std::move(newest);
  return true;
}

void Map2dNode::make_map() {
  if (surface_ == nullptr) return;
  has_new_views_ = false;
  const double start_s = steady_now_s();
  Map2dResult result =
      make_map_2d(config_, {*surface_->mesh, palette_, views_, surface_->T_world_odom});
  const double end_s = steady_now_s();
  timing_.add(end_s - start_s);
  next_s_ = end_s + std::max(kPeriod_s, (end_s - start_s) * (1.0 - kShare) / kShare);
  if (result.status == Map2dStatus::kTooLarge)
    log::limited(log::Level::kWarn, name(), "too large")
        << "no 2D map: it needs " << fixed(result.cells_needed, 0) << " cells, more than "
        << kMaxMap2dCells << "; raise map_2d.resolution_m";
  if (result.status != Map2dStatus::kMade) return;
  log::debug(name()) << result.grid.width << " x " << result.grid.height << " cells from "
                     << views_.size() << " images in " << fixed(end_s - start_s, 3) << " s";
  result.grid.anchor = surface_->anchor;
  maps_.publish(std::move(result.grid));
}

}  // namespace km
