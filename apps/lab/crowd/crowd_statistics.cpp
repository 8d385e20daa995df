#include "apps/lab/crowd/crowd_statistics.hpp"

#include <algorithm>

#include "apps/lab/crowd/place_sketch.hpp"
#include "modules/place_recognition/packed_bag.hpp"

namespace km {
namespace {

using Vectors = std::vector<BowVector>;

// Vectors of the heaviest words of images.
class Sketcher {
 public:
  Sketcher(const Vocabulary& vocabulary, std::size_t words)
      : vocabulary_(vocabulary), words_(words) {}

  [[nodiscard]] BagOfWords sketch(const BagOfWords& bag) const {
    return sketch_of(bag, vocabulary_.weigh(bag), words_);
  }
  [[nodiscard]] Vectors vectors(const std::vector<BagOfWords>& bags) const {
    Vectors vectors;
    for (const BagOfWords& bag : bags) vectors.push_back(vocabulary_.weigh(sketch(bag)));
    return vectors;
  }

 private:
  const Vocabulary& vocabulary_;
  std::size_t words_;
};

ScoreRange range_of(std::vector<double> scores) {
  if (scores.empty()) return {};
  std::ranges::sort(scores);
  return {scores[scores.size() / 2], scores.back()};
}

// Scores of each query with its most similar image.
ScoreRange best_scores(const Vectors& queries, const Vectors& images) {
  std::vector<double> best;
  for (const BowVector& query : queries) {
    best.push_back(0.0);
    for (const BowVector& image : images) best.back() = std::max(best.back(), score(query, image));
  }
  return range_of(std::move(best));
}

}  // namespace

PlaceStatistics statistics_of(const std::vector<RecordedPlace>& recordings, std::size_t which,
                              const Vocabulary& vocabulary, std::size_t words) {
  const RecordedPlace& place = recordings[which];
  const Sketcher sketcher(vocabulary, words);
  PlaceStatistics statistics;
  const auto share = 1.0 / static_cast<double>(place.first.size());
  for (const BagOfWords& bag : place.first) {
    const BagOfWords sketch = sketcher.sketch(bag);
    statistics.words += share * static_cast<double>(sketch.size());
    statistics.bytes += share * static_cast<double>(pack(sketch).size());
  }
  const Vectors first = sketcher.vectors(place.first);
  const Vectors second = sketcher.vectors(place.second);
  std::vector<double> consecutive;
  for (std::size_t i = 1; i < first.size(); ++i)
    consecutive.push_back(score(first[i], first[i - 1]));
  statistics.consecutive = range_of(std::move(consecutive));
  statistics.revisit = best_scores(second, first);
  const std::vector<std::uint32_t> others = PlaceDisguise(vocabulary).words_of(1);
  std::vector<BagOfWords> elsewhere;
  for (const BagOfWords& bag : place.first) elsewhere.push_back(disguised(bag, others));
  statistics.disguised = best_scores(second, sketcher.vectors(elsewhere));
  elsewhere.clear();
  for (std::size_t i = 0; i < recordings.size(); ++i)
    if (i != which)
      elsewhere.insert(elsewhere.end(), recordings[i].first.begin(), recordings[i].first.end());
  statistics.elsewhere = best_scores(second, sketcher.vectors(elsewhere));
  return statistics;
}

}  // namespace km
