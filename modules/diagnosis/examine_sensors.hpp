#pragma once

#include <span>
#include <vector>

#include "modules/core/camera/camera.hpp"
#include "modules/diagnosis/finding.hpp"
#include "modules/diagnosis/sensor_sample.hpp"
#include "modules/place_recognition/vocabulary.hpp"
#include "modules/sensors/dataset_reader.hpp"

namespace km {

// These functions compare the calibration of a recording with its data. Each finding has a bound
// that sound recordings keep by a wide margin. If motion or images do not determine a quantity,
// there is no finding, and a figure states the reason.

/// The finding on a fault that a reader met, by its share of the items, whose number is `of`.
/// A clock that was set is a warning, and so are inertial samples out of order or with equal stamps
/// while others remain.
[[nodiscard]] Finding finding_of(ReaderFault fault, const ReaderReport::Entry& entry, double of);

/// Examines rates, gaps and faults of the reader. Ids: frames.rate, frames.gap,
/// frames.clock, frames.stamps, imu.rate, imu.gap, imu.clock, imu.stamps, recording.no_frames,
/// `recording.<fault>`.
[[nodiscard]] Examination examine_streams(const SensorSample& sample, const ReaderReport& report);

/// Examines exposure, blur and corners. Ids: images.dark, images.bright, images.blurred,
/// images.few_corners.
[[nodiscard]] Examination examine_images(const SensorSample& sample);

/// Compares points in both images with the calibration of the pair (see StereoFit), and examines
/// the baseline and the position of the left camera (see rig_doubts()).
/// Ids: stereo.swapped, stereo.inverted, stereo.inverted_cameras, stereo.inverted_left,
/// stereo.inverted_right, stereo.exchanged_lenses, stereo.focal, stereo.epipolar,
/// stereo.other_mode, stereo.baseline, extrinsics.lever.
[[nodiscard]] Examination examine_stereo(const SensorSample& sample, const StereoRig& rig);

/// Compares recorded depth with that of the right image. Id: depth.stereo.
[[nodiscard]] Examination examine_depth(const SensorSample& sample, const StereoRig& rig);

/// Compares rotations of gyroscope and images (see InertialFit) and accelerations (see
/// AccelerationFit), and examines gravity. Ids: imu.accel_negated, depth.scale,
/// imu.gyro_in_degrees, imu.gyro_scale, imu.unrelated, imu.mirrored, imu.time_offset,
/// extrinsics.inverted, extrinsics.rotation, camera.focal, imu.accel_in_g, imu.no_gravity,
/// imu.gravity.
[[nodiscard]] Examination examine_inertial(const SensorSample& sample, const StereoRig& rig);

/// Examines how well the words of a vocabulary distinguish the features of `images`. The measure is
/// exp(entropy), the number of equally frequent words with the same information. It is compared
/// with the numbers of features and of words. Id: vocabulary.coverage.
[[nodiscard]] Examination examine_words(std::span<const std::vector<BinaryDescriptor>> images,
                                        const Vocabulary& vocabulary);

}  // namespace km
