#pragma once

#include "modules/core/camera/frame.hpp"
#include "modules/core/camera/tracked_image.hpp"
#include "modules/core/data/closure_verdicts.hpp"
#include "modules/core/data/processing_load.hpp"
#include "modules/core/map/dense_frame.hpp"
#include "modules/core/map/occupancy_grid.hpp"
#include "modules/dense_sensing/dense_sensor.hpp"
#include "modules/loop_closure/keyframe_requests.hpp"
#include "modules/mesh/map_mesh.hpp"
#include "modules/mesh/node/mesh_chunks_node.hpp"
#include "modules/mesh_deformation/mesh_corrector.hpp"
#include "modules/objects/node/objects_node.hpp"
#include "modules/place_recognition/bag_of_words.hpp"
#include "modules/place_recognition/place_database.hpp"
#include "modules/semantic_mapping/semantic_mapper.hpp"
#include "modules/session/team_messages.hpp"
#include "modules/vio/vio_statistics.hpp"
#include "runtime/dds/bridge.hpp"
#include "runtime/dds/robot_status.hpp"
#include "runtime/overlay/overlay_node.hpp"

namespace km {

/// Messages to single robots, in range or not. OverlayNode connects the three.
template <typename T>
struct TeamChannel {
  Topic<Addressed<T>> own;      ///< From the nodes of this robot.
  AddressedCrossing<T> direct;  ///< Between robots in range.
  Topic<T> received;            ///< From robots in range and out of range.

  [[nodiscard]] RelayedTopics<T> ends() {
    return {own, direct.to_peers(), direct.from_peers(), received};
  }
};

/// Every channel of a robot. Only Crossing and TeamChannel leave the process.
struct Topics {
  Topic<SensorPacket> packets;
  Topic<ProcessedFrame> processed_frames;
  Topic<ShedLoad> shed_load;
  Topic<OdometryState> odometry, restored_odometry;
  Topic<KeyframeOdometry> keyframe_odometry;
  Topic<Keyframe> new_keyframes, keyframes;  // keyframes: only those that are on the disk
  Topic<LocatedFrame> located_frames;
  Topic<VioStatistics> odometry_statistics;
  Topic<TrackedImage> tracked_images;
  Topic<DenseFrame> dense_frames;
  Topic<DenseSensingProgress> dense_sensing_progress;
  Topic<MapMesh> maps;
  Topic<OptimizedMesh> optimized_meshes;
  Topic<SupersededSurface> superseded_surface;
  Topic<ObjectList> joint_objects;
  Topic<OccupancyGrid> maps_2d;
  Topic<MappingProgress> mapping_progress;
  Topic<RelativePose> measured_closures;
  Topic<PlaceQuery> place_queries;
  Topic<LoopCandidate> candidates;
  Topic<PeerEvent> candidate_restarts, new_closure_restarts,
      closure_restarts;  // points at which candidates and closures restart
  Topic<ClosureOutcome> outcomes, restored_outcomes;
  // new_closures: found by this robot; own_closures: those on the disk; closures: own_closures and
  // received ones.
  Topic<Closure> new_closures, own_closures, closures;
  Topic<PositionFix> fixes;
  Topic<InlierSet> own_inlier_sets;
  Topic<Trajectory> trajectory;
  Topic<OptimizerProgress> progress;
  Topic<ClosureVerdicts> closure_verdicts;
  Topic<InlierSet> restored_inlier_sets;

  // Inputs and outputs of OverlayNode, which connects them to the crossings below.
  Topic<PeerEvent> ways;  // peer events, and peers that can be reached through other robots only
  Topic<KeyframeBow> peer_bows;
  Topic<TeamMessage> team_messages, peer_team_messages;
  Topic<LinksReport> links;

  Crossing<KeyframeBow> bows;
  TeamChannel<KeyframeRequest> requests;
  TeamChannel<KeyframeReply> replies;
  TeamChannel<KeyframeWords> words;
  TeamChannel<Closure> shared_closures;  // between this robot and others
  TeamChannel<InlierSet> shared_inlier_sets;
  AddressedCrossing<TeamLanePacket> team_packets;
  AddressedCrossing<PlacesLanePacket> places_packets;
  // To the other robots and to the map of the team.
  Topic<MeshChunk> sent_chunks;
  Topic<MeshPoses> sent_mesh_poses;
  Crossing<MeshChunk> chunks;
  Crossing<MeshPoses> mesh_poses;
  Topic<RobotObjects> sent_objects;  // to the other robots and to the search for places
  Crossing<RobotObjects> objects;
  Crossing<RobotStatus> status;
};

template <typename T>
void forward(In<T> from, Out<T> to) {
  from.subscribe([to](const auto& message) { to.publish(message); });
}

}  // namespace km
