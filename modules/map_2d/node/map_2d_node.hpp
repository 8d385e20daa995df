#pragma once

#include <memory>
#include <variant>
#include <vector>

#include "modules/core/map/dense_frame.hpp"
#include "modules/core/map/label_palette.hpp"
#include "modules/core/map/occupancy_grid.hpp"
#include "modules/map_2d/map_2d.hpp"
#include "modules/map_2d/map_2d_config.hpp"
#include "modules/map_2d/view_rays.hpp"
#include "modules/mesh/labelled_mesh.hpp"
#include "runtime/latest.hpp"
#include "runtime/metrics.hpp"
#include "runtime/worker_node.hpp"

namespace km {

/// A corrected mesh, and the motion of its keyframes from odometry to it.
struct CorrectedSurface {
  std::shared_ptr<const LabelledMesh> mesh;  ///< In `world`.
  std::vector<SE3> T_world_odom;             ///< See Map2dInput.
  RobotId anchor = 0;                        ///< Robot whose odometry frame is `world`.
};

/// Channels of the node of the 2D map; they must outlive it.
struct Map2dTopics {
  In<DenseFrame> frames;
  Out<OccupancyGrid> maps;  ///< In `world`.
};

/// Makes the 2D map of a robot's whole run from its corrected mesh and the rays of its images.
///
/// The mesh and the rays are kept in 3D, and each map is made from scratch. So a map agrees with
/// the poses of its mesh, also after loop closures. At most kViews images are kept:
/// at that number every second one is dropped.
class Map2dNode final : public WorkerNode<std::variant<Tick, std::shared_ptr<const ViewRays>>> {
 public:
  static constexpr std::size_t kViews = 4096;

  /// `thinner` is used on the thread that publishes the frames. Throws ConfigError if `config` is
  /// out of bounds.
  Map2dNode(const Map2dConfig& config, const LabelPalette& palette, RayThinner thinner,
            const Map2dTopics& topics);
  ~Map2dNode() override { stop(); }

  /// Durations of making maps.
  DurationHistogram timing() const override { return timing_.histogram(); }

  /// Replaces the mesh. Thread-safe; does not wait for a map.
  void offer(CorrectedSurface surface);

 private:
  using Views = std::shared_ptr<const ViewRays>;

  void handle(const Input& input) override;
  /// Publishes the map of the last mesh and all images.
  void conclude() override {
    if (take_surface() || has_new_views_) make_map();
  }
  void step(const Views& views);
  bool take_surface();
  void make_map();

  const Map2dConfig config_;
  const LabelPalette palette_;
  const Out<OccupancyGrid> maps_;
  RayThinner thinner_;
  std::vector<ViewRays> views_;
  double next_s_ = 0.0;         // time of the next map, by the steady clock
  bool has_new_views_ = false;  // since the last map
  Timing timing_;
  std::shared_ptr<const CorrectedSurface> surface_;
  Latest<CorrectedSurface> newest_surface_;
};

}  // namespace km
