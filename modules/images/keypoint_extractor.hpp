#pragma once

#include <opencv2/features2d.hpp>

#include "modules/core/data/keyframe.hpp"

namespace km {

/// Factor between the levels of the pyramid in which keypoints are detected, and their number.
inline constexpr double kPyramidScale = 1.2;
inline constexpr int kPyramidLevels = 8;

/// Detector and descriptor of the keypoints by which places are recognised and verified: ORB
/// (Rublee et al., "ORB: an efficient alternative to SIFT or SURF", ICCV 2011). Keyframes,
/// vocabularies and examinations of recordings use this function, because only descriptors of one
/// kind can be compared. Octaves are levels of the pyramid. Each keypoint has a row of
/// kDescriptorBytes bytes, compared by Hamming distance. Corners have a contrast of at least
/// `min_contrast` [grey levels].
[[nodiscard]] cv::Ptr<cv::Feature2D> make_keypoint_extractor(int max_keypoints,
                                                             int min_contrast = 20);

/// The descriptor in `row` of a result of make_keypoint_extractor().
[[nodiscard]] BinaryDescriptor descriptor_of_row(const cv::Mat& descriptors, int row);

/// The descriptors of all rows.
[[nodiscard]] std::vector<BinaryDescriptor> descriptors_of_rows(const cv::Mat& descriptors);

}  // namespace km
