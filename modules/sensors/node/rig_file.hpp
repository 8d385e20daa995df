#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "modules/core/camera/calibration_limits.hpp"
#include "modules/core/camera/camera_calibration.hpp"
#include "modules/core/config.hpp"
#include "modules/sensors/rig_completion.hpp"

namespace km {

/// Keys of a file that correct a calibration.
struct RigCorrectionFile {
  std::optional<double> camera_time_offset_s;
  std::vector<double> T_body_rig;

  void visit_fields(auto& visitor) {
    visitor.field("camera_time_offset_s", camera_time_offset_s, kTimeOffset_s,
                  "[s] added to the stamps of images to get the IMU's time; none: the value of the "
                  "calibration, or 0");
    visitor.field("T_body_rig", T_body_rig, {-1e3, 1e3},
                  "[m] 16 numbers, row by row: correction that multiplies the poses of the cameras "
                  "in the body from the left; empty: no correction");
    visitor.check(T_body_rig.empty() || T_body_rig.size() == 16, "T_body_rig",
                  "has not 16 numbers");
  }
};

/// A user's description of the sensors of a recording or of a live robot: their topics and their
/// calibration.
struct RigFile {
  struct Camera {
    std::string topic;
    int camera = 0;
    std::string info_topic;
    std::optional<bool> rectified;

    void visit_fields(auto& visitor) {
      visitor.field("topic", topic, "sensor_msgs/Image or CompressedImage");
      visitor.field("camera", camera, {0, 99}, "number in the calibration: cam0, cam1, ...");
      visitor.field("info_topic", info_topic,
                    "sensor_msgs/CameraInfo, used if the calibration lacks the camera; empty: "
                    "camera_info beside the images");
      visitor.field("rectified", rectified,
                    "images are rectified, as P of CameraInfo states; none: true if rect is in the "
                    "topic's last name");
      visitor.required({"topic"});
    }
  };
  struct Depth {
    std::string topic;
    double scale_m = 1e-3;
    double min_range_m = 0.0, max_range_m = 65.0;
    double baseline_m = 0.1;
    bool aligned = false;

    void visit_fields(auto& visitor) {
      visitor.field("topic", topic,
                    "images of depth, aligned with the left ones; without a right camera the rig "
                    "is an RGB-D one; empty: none");
      visitor.field("aligned", aligned,
                    "true: accept depth whose frame or CameraInfo is not that of the left images");
      visitor.field("scale_m", scale_m, kDepthScale_m,
                    "[m] depth of one unit in images of 16 bits; images of 32 bits are in metres");
      visitor.field("min_range_m", min_range_m, {0.0, kDepthRange_m.max},
                    "[m] smallest distance that the sensor measures");
      visitor.field("max_range_m", max_range_m, kDepthRange_m,
                    "[m] largest distance that the sensor measures");
      visitor.field("baseline_m", baseline_m, kDepthBaseline_m,
                    "[m] virtual baseline of an RGB-D sensor: errors of depth z are about z^2 / "
                    "(focal length in px * baseline)");
      visitor.check(min_range_m < max_range_m, "min_range_m", "is not less than max_range_m");
    }
  };
  struct Imu {
    std::string topic, gyro_topic, accel_topic;

    void visit_fields(auto& visitor) {
      visitor.field("topic", topic, "sensor_msgs/Imu; or both of:");
      visitor.field("gyro_topic", gyro_topic, "sensor_msgs/Imu with angular velocities alone");
      visitor.field("accel_topic", accel_topic, "sensor_msgs/Imu with accelerations alone");
      const bool both = !gyro_topic.empty() && !accel_topic.empty();
      const bool neither = gyro_topic.empty() && accel_topic.empty();
      visitor.check(topic.empty() ? both : neither, "topic",
                    "is needed, or gyro_topic and accel_topic");
    }
  };

  struct Odometry {
    std::string topic;
    std::optional<std::filesystem::path> file;
    std::vector<double> T_child_body;

    void visit_fields(auto& visitor) {
      visitor.field("topic", topic, "nav_msgs/Odometry without jumps (its tf `odom`, not `map`)");
      visitor.field("file", file, Input{},
                    "or poses of the body, TUM: t[s] x y z qx qy qz qw, each optionally with the "
                    "36 numbers of a covariance as in nav_msgs/Odometry");
      visitor.field("T_child_body", T_child_body, {-1e3, 1e3},
                    "[m] 16 numbers, row by row: pose of the body in the topic's child frame; "
                    "empty: the frames are equal");
      visitor.check(topic.empty() || !file, "topic", "is there beside file: name one");
      visitor.check(T_child_body.empty() || T_child_body.size() == 16, "T_child_body",
                    "has not 16 numbers");
    }
  };

  Camera left, right = {.topic = {}, .camera = 1, .info_topic = {}, .rectified = {}};
  Depth depth;
  Imu imu;
  Odometry odometry;
  std::vector<std::filesystem::path> calibration;
  std::string body_frame;
  RigCorrectionFile correction;

  [[nodiscard]] bool has_imu() const { return !imu.topic.empty() || !imu.gyro_topic.empty(); }
  [[nodiscard]] bool has_odometry() const {
    return !odometry.topic.empty() || odometry.file.has_value();
  }

  void visit_fields(auto& visitor) {
    visitor.section("left", left);
    visitor.section("right", right, "omit it for an RGB-D camera");
    visitor.section("depth", depth);
    visitor.section("imu", imu, "omit it for odometry by images alone");
    visitor.section("odometry", odometry,
                    "external odometry of the robot, which replaces odometry by images");
    visitor.field("calibration", calibration, Input{},
                  "relative to this file: Kalibr's files ([camchain.yaml, imu.yaml]), one of "
                  "Basalt (.json), a EuRoC folder with the sensor.yaml of cam0, cam1 and imu0, or "
                  "keys as in Kalibr's files; CameraInfo and /tf_static supply missing parts");
    visitor.field("body_frame", body_frame,
                  "frame of the inertial sensor in /tf_static; empty: the frame in its messages, "
                  "or without an inertial sensor the child frame of the odometry; without "
                  "either the body is the left camera");
    correction.visit_fields(visitor);
    visitor.required({"left"});
    visitor.check(
        !right.topic.empty() || !depth.topic.empty(), "left",
        "is alone: a right camera or depth is needed, because one camera does not measure "
        "distances");
  }
};

/// Reads a rig file and its calibration. Throws ConfigError with every problem by file and line,
/// and DatasetError for a calibration that cannot be used.
[[nodiscard]] PartialRig read_rig_file(const std::filesystem::path& file);

/// Reads a file with only the keys of RigCorrectionFile, for a recording that contains its own
/// calibration. Errors as for read_rig_file().
[[nodiscard]] CameraCalibration read_rig_correction(const std::filesystem::path& file);

/// The text of a rig file with `correction`. All other keys are those of the rig file `base`, with
/// paths that do not depend on the folder. If `base` is empty, the text is one for
/// read_rig_correction(). Comments are not kept. Throws ConfigError if `base` cannot be read.
[[nodiscard]] std::string corrected_rig_text(const std::filesystem::path& base,
                                             const CameraCalibration& correction);

/// Topic on which drivers usually publish the CameraInfo of a topic of images: "/left/camera_info"
/// for "/left/image_raw" and for "/left/image_raw/compressed".
[[nodiscard]] std::string camera_info_beside(const std::string& topic);

/// The text of a rig file: keys with their meaning.
[[nodiscard]] std::string rig_file_text(RigFile rig);

}  // namespace km
