#include "modules/localization/map_matcher.hpp"

#include <algorithm>
#include <bit>
#include <stdexcept>
#include <utility>

#include "modules/core/io/bytes.hpp"

namespace km {

std::uint64_t FinishedMap::id() const {
  std::uint64_t id = kFnv1aBasis;
  for (const SE3& T : T_map_kf)
    for (const double x : T.matrix().topRows<3>().reshaped())
      mix_fnv1a(id, std::bit_cast<std::uint64_t>(x + 0.0));  // -0.0 equals 0.0
  return std::max<std::uint64_t>(id, 1);
}

MapMatcher::MapMatcher(const PlaceRecognitionConfig& places, const LoopClosureConfig& closures,
                       std::shared_ptr<const Vocabulary> vocabulary, FinishedMap map)
    : map_(std::move(map)),
      vocabulary_(std::move(vocabulary)),
      places_(places, vocabulary_->size()),
      verifier_(closures) {
  if (map_.keyframes.empty() || map_.keyframes.size() != map_.T_map_kf.size())
    throw std::invalid_argument("MapMatcher: a map needs keyframes, and a pose for each");
  for (const Keyframe& keyframe : map_.keyframes)
    places_.add(vocabulary_->transform(keyframe.features.descriptors), keyframe.stamp);
}

MapMatch MapMatcher::match(const Keyframe& keyframe) {
  BowVector words = vocabulary_->transform(keyframe.features.descriptors);
  const CandidateSearch search = places_.search(words, score(words, previous_));
  previous_ = std::move(words);
  MapMatch result{.candidates = search.candidates.size()};
  for (const PlaceCandidate& candidate : search.candidates) {
    const Keyframe& place = map_.keyframes[candidate.index];
    Verification verification = verifier_.verify(place.features, keyframe.features);
    const bool is_accepted = verification.status == VerificationStatus::kAccepted;
    if (!is_accepted && &candidate != &search.candidates.front()) continue;
    result.similarity = candidate.similarity;
    result.verification = std::move(verification);
    if (!is_accepted) continue;
    const SE3 T_0_place = map_.T_map_kf.front().inverse() * map_.T_map_kf[candidate.index];
    result.closure =
        Closure{.from = {{keyframe.odometry.id.robot, 0}, map_.T_map_kf.front(), Matrix6::Zero()},
                .to = keyframe.odometry,
                .T_from_to = T_0_place * result.verification.T_from_to,
                .covariance = result.verification.covariance,
                .inliers = result.verification.inliers,
                .similarity = candidate.similarity};
    break;
  }
  return result;
}

}  // namespace km
