#include "apps/lab/crowd/crowd_world.hpp"

#include <random>
#include <stdexcept>
#include <utility>

namespace km {
namespace {

void check(const std::vector<RecordedPlace>& recordings, const CrowdOptions& options) {
  if (recordings.empty()) throw std::invalid_argument("CrowdWorld: no recorded places");
  if (options.partners % 2 != 0 || options.partners >= options.robots)
    throw std::invalid_argument(
        "CrowdWorld: the number of partners must be even and below that of "
        "the robots");
  if (options.robots > UINT16_MAX) throw std::invalid_argument("CrowdWorld: more robots than ids");
}

}  // namespace

CrowdWorld::CrowdWorld(const std::vector<RecordedPlace>& recordings, const CrowdOptions& options)
    : recordings_(recordings), runs_(options.robots), places_(options.robots) {
  check(recordings, options);
  std::mt19937 random(options.seed);
  std::uint32_t next_place = 1;
  const auto new_stretch = [&] {
    return Stretch{.place = next_place++, .recording = random() % recordings.size()};
  };
  for (std::size_t a = 0; a < options.robots; ++a)
    for (std::size_t beside = 1; beside <= options.partners / 2; ++beside)
      for (std::size_t i = 0; i < options.meetings; ++i) {
        Stretch stretch = new_stretch();
        runs_[a].push_back(stretch);
        stretch.second = true;
        runs_[(a + beside) % options.robots].push_back(stretch);
      }
  for (std::size_t robot = 0; robot < options.robots; ++robot) {
    std::vector<Stretch>& run = runs_[robot];
    std::size_t keyframes = 0;
    for (const Stretch& stretch : run) keyframes += visit(stretch).size();
    while (keyframes < options.keyframes) {
      run.push_back(new_stretch());
      keyframes += visit(run.back()).size();
    }
    for (std::size_t i = run.size(); i > 1; --i) std::swap(run[i - 1], run[random() % i]);
    for (const Stretch& stretch : run)
      places_[robot].insert(places_[robot].end(), visit(stretch).size(), stretch.place);
  }
}

std::optional<BagOfWords> CrowdReplay::next() {
  const std::vector<Stretch>& run = world_.run(robot_);
  if (stretch_ < run.size() && keyframe_ == world_.visit(run[stretch_]).size()) {
    ++stretch_;
    keyframe_ = 0;
  }
  if (stretch_ == run.size()) return std::nullopt;
  if (keyframe_ == 0) words_ = disguise_.words_of(run[stretch_].place);
  return disguised(world_.visit(run[stretch_])[keyframe_++], words_);
}

}  // namespace km
