#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <utility>
#include <vector>

#include "apps/lab/crowd/crowd_meter.hpp"
#include "apps/lab/crowd/crowd_world.hpp"
#include "apps/lab/crowd/virtual_network.hpp"
#include "modules/loop_closure/peer_words.hpp"
#include "modules/loop_closure/request_policy.hpp"
#include "modules/place_recognition/place_database.hpp"
#include "modules/place_recognition/vocabulary.hpp"

namespace km {

/// Results of the searches of a robot among the keyframes of its peers.
struct CrowdFindings {
  std::size_t bags = 0;              ///< Received.
  std::size_t true_candidates = 0;   ///< Pairs of keyframes of the same place.
  std::size_t false_candidates = 0;  ///< Other pairs.
  std::size_t true_requests = 0;     ///< Keyframes requested from peers for verification.
  std::size_t false_requests = 0;
  std::size_t verifications = 0;
  std::map<std::uint32_t, std::set<KeyframeId>> found;  ///< By place: peers' keyframes with a
                                                        ///< candidate.
  std::map<std::uint32_t, std::size_t> closures;        ///< By place: number.
};

/// The part of a robot that searches places: the robots' own classes, in their own configuration.
/// Features are not simulated: a candidate at the same place verifies with a given probability, any
/// other fails.
class CrowdRobot {
 public:
  CrowdRobot(const CrowdWorld& world, const Vocabulary& vocabulary, RobotId self,
             double verified_share, const CrowdMeter& meter);

  /// Adds the own keyframe `index`.
  void add_own(const BagOfWords& bag, KeyframeIndex index);
  /// Takes the packed bag of a peer's keyframe and its normaliser, searches, and requests
  /// keyframes. `stores_bag`: the bag is kept for robots out of reach, as the overlay does.
  void receive(const KeyframeId& keyframe, std::span<const std::uint8_t> packed, double normalizer,
               bool stores_bag);

  [[nodiscard]] const CrowdFindings& findings() const { return findings_; }
  [[nodiscard]] const CrowdWork& work() const { return work_; }
  /// Messages of geometric verification that this robot sends and receives.
  [[nodiscard]] const CrowdTraffic& verification_sent() const { return sent_; }
  [[nodiscard]] const CrowdTraffic& verification_received() const { return received_; }

 private:
  CandidateSearch search(const KeyframeId& keyframe, std::span<const std::uint8_t> packed,
                         double normalizer, bool stores_bag);
  void judge(const KeyframeId& query, const PlaceCandidate& candidate);
  void request(const KeyframeId& query, bool is_true);

  const CrowdWorld& world_;
  const Vocabulary& vocabulary_;
  const RobotId self_;
  const double verified_share_;
  const CrowdMeter& meter_;
  PlaceDatabase own_;
  PeerWords words_;
  std::map<KeyframeId, std::vector<std::uint8_t>> stored_;
  RequestPolicy policy_;
  std::set<KeyframeId> requested_;
  CrowdFindings findings_;
  CrowdWork work_;
  CrowdTraffic sent_;
  CrowdTraffic received_;
};

}  // namespace km
