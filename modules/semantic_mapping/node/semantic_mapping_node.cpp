#include "modules/semantic_mapping/node/semantic_mapping_node.hpp"

#include "modules/core/io/text_table.hpp"
#include "runtime/log.hpp"

namespace km {
namespace {

constexpr std::size_t kQueuedFrames = 2;
constexpr std::size_t kFirstFrames = 5;  // frames whose depths decide on the side of voxels

}  // namespace

SemanticMappingNode::SemanticMappingNode(const SemanticMappingConfig& config, const Camera& camera,
                                         const LabelPalette& palette, double mesh_interval_s,
                                         Overflow overflow, const SemanticMappingTopics& topics)
    : WorkerNode({.name = SemanticMappingConfig::kSection,
                  .queue = kQueuedFrames,
                  .overflow = overflow,
                  .in_background = true}),
      config_(checked(config)),
      camera_(camera),
      palette_(palette),
      mesh_interval_s_(mesh_interval_s),
      topics_(topics) {
  follow(topics.frames);
  topics_.superseded.subscribe([this](const auto& superseded) { superseded_.put(superseded); });
}

void SemanticMappingNode::conclude() {
  map_first();
  if (progress_.integrated == 0 && !before_) return;
  progress_.too_late = load().dropped;
  publish_mesh();
  if (mapper_) progress_.size = mapper_->size();
  topics_.progress.publish(progress_);
  const MappingProgress& p = progress_;
  log::info(name()) << p.integrated << " frames, " << p.size.vertices << " vertices, "
                    << p.size.faces << " faces, " << p.size.dropped_faces
                    << " more seen again and dropped; too late " << p.too_late;
  if (p.wrong_size + p.bad_pose + p.off_palette_pixels + p.blocks_refused > 0)
    log::warn(name()) << "skipped " << p.wrong_size << " frames of the wrong size and "
                      << p.bad_pose << " without a usable pose; " << p.off_palette_pixels
                      << " pixels with labels outside the palette; " << p.blocks_refused
                      << " blocks beyond max_blocks";
}

void SemanticMappingNode::drop_superseded() {
  const Topic<SupersededSurface>::Message superseded = superseded_.take();
  if (superseded == nullptr) return;
  const SupersededSurface own = before_ ? before_->drop(*superseded) : *superseded;
  if (!mapper_) return;
  const SurfaceDrop dropped = mapper_->drop(own);
  log::debug(name()) << "dropped " << dropped.faces << " faces seen again";
}

void SemanticMappingNode::step(const DenseFrame& frame) {
  drop_superseded();
  if (mapper_) return map(frame);
  first_.push_back(frame);
  if (config_.voxel_size_m || first_.size() == kFirstFrames) map_first();
}

void SemanticMappingNode::map_first() {
  if (first_.empty()) return;
  make_mapper();
  for (const DenseFrame& frame : std::exchange(first_, {})) map(frame);
}

void SemanticMappingNode::map(const DenseFrame& frame) {
  count(frame, mapper_->integrate(*frame.depth, frame.labels.get(), frame.T_odom_cam,
                                  frame.keyframe, frame.color.get()));
  // The mesh is updated once for each keyframe, so that a vertex gets the first one that saw it.
  if (meshed_ != frame.keyframe) mapper_->update_mesh();
  meshed_ = frame.keyframe;
  if (!published_) published_ = frame.stamp;
  if (seconds_between(*published_, frame.stamp) >= mesh_interval_s_) {
    published_ = frame.stamp;
    publish_mesh();
  }
  progress_.size = mapper_->size();
  topics_.progress.publish(progress_);
}

void SemanticMappingNode::make_mapper() {
  const bool is_chosen = !config_.voxel_size_m;
  std::vector<std::shared_ptr<const DepthImage>> images;
  for (const DenseFrame& frame : first_) images.push_back(frame.depth);
  if (is_chosen) config_.voxel_size_m = fitting_voxel_m(config_, images);
  log::info(name()) << "voxels from " << fixed(*config_.voxel_size_m, 3) << " m on"
                    << (is_chosen ? ", by the depths of the first images" : "") << "; depths up to "
                    << fixed(config_.max_range_m, 1) << " m";
  mapper_.emplace(config_, camera_, palette_);
}

void SemanticMappingNode::count(const DenseFrame& frame, const IntegrationReport& report) {
  const bool integrated = report.status == IntegrationStatus::kIntegrated;
  progress_.integrated += integrated ? 1 : 0;
  progress_.wrong_size += report.status == IntegrationStatus::kDepthSizeDiffers ? 1 : 0;
  progress_.bad_pose += report.status == IntegrationStatus::kPoseUnusable ? 1 : 0;
  progress_.unlabelled +=
      integrated && (frame.labels == nullptr || report.label_size_differs) ? 1 : 0;
  progress_.off_palette_pixels += report.off_palette_pixels;
  progress_.blocks_refused += report.blocks_refused;
  progress_.too_late = load().dropped;
}

void SemanticMappingNode::publish_mesh() {
  MapMesh map;
  if (mapper_) {
    mapper_->update_mesh();
    map = mapper_->mesh();
  }
  if (map.mesh.colors.empty() && !map.mesh.labels.empty()) map.mesh.colour_by(palette_);
  topics_.maps.publish(before_ ? before_->with(map) : std::move(map));
}

}  // namespace km
