#pragma once

#include <cstddef>
#include <functional>
#include <map>
#include <span>
#include <vector>

#include "modules/core/ids.hpp"
#include "modules/tree_newton/pose_edge.hpp"

namespace km {

struct PairVote;

/// Number of noise factors of odometry that a team compares: the powers of two from 1 to 32.
inline constexpr std::size_t kNoiseLevels = 6;

/// Log likelihood of the cycles of two robots a < b, by the noise of their odometry. In element
/// kNoiseLevels * i + j, a is 2^i and b is 2^j times noisier than it claims. A cycle leads through
/// the first closures of two places, and along the odometry of both robots between them. Each place
/// has cycles with its three nearest ones.
///
/// Model: the error of a cycle is normal with covariance 4^i C_a + 4^j C_b + s^2 (S_1 + S_2), or a
/// closure is false (see cycle_mixture.hpp). C are the claimed covariances of the odometry, with
/// lever arms, and S those of the closures. The factor s of the pair is the likeliest one of 1, 2,
/// 4 and 8, with the Cauchy prior of closure_noise.hpp. A place counts as one observation. Empty if
/// there are fewer than three places. If the likeliest noise leaves three quarters of the cycles
/// false, nothing is likelier than the claims: noise may not be what makes false closures true.
///
/// `closures`: between a and b. `pose`: of their ends, by odometry. `step`: mean weights of a step
/// of odometry of each robot. Both robots compute equal values. O(n log n) for n closures.
[[nodiscard]] std::vector<float> odometry_evidence(
    std::span<const PoseEdge> closures, const std::function<SE3(const KeyframeId&)>& pose,
    const std::map<RobotId, Precision>& step, int dimension);

/// The robots whose odometry is noisier than it claims, with the factor on its standard deviations.
/// The factors maximise the sum of the evidence of all pairs and the log prior of each robot (the
/// same Cauchy distribution). A robot is left out unless the odds are 10 to 1 beside the factors of
/// the others. It is also left out if it has evidence in several pairs, and all but one of them
/// refute its noise, also half of it, with these odds. If more than half of the robots seem noisy,
/// the closures may be the reason, and the result is empty.
[[nodiscard]] std::map<RobotId, double> likely_odometry_noise(std::span<const PairVote> pairs);

}  // namespace km
