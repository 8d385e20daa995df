#include <algorithm>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <span>

#include "apps/output_file.hpp"
#include "apps/vocabulary/commands.hpp"
#include "apps/vocabulary/images.hpp"
#include "modules/core/text_table.hpp"
#include "modules/evaluation/association.hpp"
#include "modules/evaluation/trajectory_file.hpp"
#include "modules/place_recognition/vocabulary_file.hpp"

namespace km {
namespace {

struct EvaluateCommand : VocabularyCommand {
  std::vector<std::string> known;    ///< Images of the robot whose keyframes are searched.
  std::vector<std::string> queries;  ///< Images of the robot that searches.
  std::string truth;                 ///< Poses: TUM or EuRoC.
  double max_distance_m = 2.0;
  double max_angle_deg = 45.0;
  double min_normalizer = 0.05;
  std::size_t max_candidates = 1000000;  ///< Per query, the best ones.
};

constexpr double kTruthTolerance_s = 0.05;  // ground truth comes at 20 Hz or faster

struct View {
  BowVector vector;
  SE3 T_world_body;
};

// Views in order of time; images without ground truth are left out.
std::vector<View> views_of(const std::vector<std::string>& inputs, const Vocabulary& vocabulary,
                           const std::vector<StampedPose>& truth, const EvaluateCommand& command) {
  auto images = list_images(inputs, command.every);
  std::sort(images.begin(), images.end(),
            [](const auto& a, const auto& b) { return stamp_of_image(a) < stamp_of_image(b); });
  const auto descriptors = image_descriptors(images, command.features);
  std::vector<View> views;
  for (std::size_t i = 0; i < images.size(); ++i)
    if (const auto T = pose_at(truth, stamp_of_image(images[i]), 0.0, kTruthTolerance_s))
      views.push_back({vocabulary.transform(descriptors[i]), *T});
  if (views.empty()) throw std::runtime_error("no image has a pose in " + command.truth);
  return views;
}

// A pair of views with a usable normaliser.
struct Pair {
  std::size_t query;
  double similarity;
  bool same_place;
};

// Among the pairs of one query, only the best can become candidates.
void drop_all_but_best(std::span<Pair> pairs, std::size_t count) {
  std::vector<Pair*> order;
  for (Pair& pair : pairs) order.push_back(&pair);
  std::stable_sort(order.begin(), order.end(),
                   [](const Pair* a, const Pair* b) { return a->similarity > b->similarity; });
  for (std::size_t i = count; i < order.size(); ++i) order[i]->similarity = 0.0;
}

std::vector<Pair> compare(const std::vector<View>& queries, const std::vector<View>& known,
                          const EvaluateCommand& command) {
  std::vector<Pair> pairs;
  for (std::size_t i = 1; i < queries.size(); ++i) {
    const double normalizer = score(queries[i].vector, queries[i - 1].vector);
    for (const View& view : known) {
      const SE3 T_query_known = queries[i].T_world_body.inverse() * view.T_world_body;
      const bool same =
          T_query_known.translation().norm() <= command.max_distance_m &&
          angle_of(T_query_known.linear()) <= command.max_angle_deg * std::numbers::pi / 180.0;
      const bool usable = normalizer > 0.0 && normalizer >= command.min_normalizer;
      const double similarity = usable ? score(queries[i].vector, view.vector) / normalizer : 0.0;
      pairs.push_back({i, similarity, same});
    }
    drop_all_but_best({pairs.end() - static_cast<std::ptrdiff_t>(known.size()), pairs.end()},
                      command.max_candidates);
  }
  return pairs;
}

struct Row {
  double threshold = 0.0;
  std::size_t candidates = 0;  // pairs at or above the threshold
  std::size_t correct = 0;     // candidates that show the same place
  std::size_t queries = 0;     // queries that see a known place
  std::size_t recognised = 0;  // such queries with a correct candidate
  double precision() const { return candidates == 0 ? 1.0 : ratio(correct, candidates); }
  double query_recall() const { return queries == 0 ? 1.0 : ratio(recognised, queries); }
  static double ratio(std::size_t a, std::size_t b) {
    return static_cast<double>(a) / static_cast<double>(b);
  }
};

Row row_at(double threshold, const std::vector<Pair>& pairs, std::size_t query_count) {
  Row row{.threshold = threshold};
  std::vector<bool> has_place(query_count, false);
  std::vector<bool> is_recognised(query_count, false);
  for (const Pair& pair : pairs) {
    if (pair.same_place) has_place[pair.query] = true;
    if (pair.similarity < threshold) continue;
    ++row.candidates;
    if (!pair.same_place) continue;
    ++row.correct;
    is_recognised[pair.query] = true;
  }
  row.queries = static_cast<std::size_t>(std::count(has_place.begin(), has_place.end(), true));
  row.recognised =
      static_cast<std::size_t>(std::count(is_recognised.begin(), is_recognised.end(), true));
  return row;
}

void print(const std::vector<Row>& rows, std::size_t same, std::size_t all) {
  std::vector<std::vector<std::string>> table = {
      {"threshold", "candidates", "precision", "pair recall", "query recall"}};
  for (const Row& row : rows)
    table.push_back({fixed(row.threshold, 2), std::to_string(row.candidates),
                     fixed(row.precision(), 3),
                     fixed(Row::ratio(row.correct, std::max<std::size_t>(1, same)), 3),
                     fixed(row.query_recall(), 3)});
  std::cout << same << " of " << all << " pairs show the same place, seen by " << rows[0].queries
            << " queries\n"
            << align_columns(table);
}

void write_json(std::ostream& out, const std::vector<Row>& rows, std::size_t same) {
  nlohmann::ordered_json json{{"pairs_of_same_place", same}, {"rows", nlohmann::json::array()}};
  for (const Row& row : rows)
    json["rows"].push_back({{"threshold", row.threshold},
                            {"candidates", row.candidates},
                            {"correct", row.correct},
                            {"queries", row.queries},
                            {"recognised", row.recognised}});
  out << json << '\n';
}

void define(CLI::App& app, EvaluateCommand& command) {
  app.add_option("vocabulary", command.vocabulary, "Vocabulary file")->required();
  app.add_option("--known", command.known, "IMAGES a robot has taken, named by stamp [ns]")
      ->required();
  app.add_option("--queries", command.queries, "IMAGES another robot sends, named by stamp [ns]")
      ->required();
  app.add_option("--truth", command.truth, "Poses of both: TUM text, or EuRoC .csv")->required();
  app.add_option("--max-distance", command.max_distance_m,
                 "Two images show the same place up to this distance [m] ...")
      ->capture_default_str();
  app.add_option("--max-angle", command.max_angle_deg, "... and this angle between them [deg]")
      ->capture_default_str();
  app.add_option("--min-normalizer", command.min_normalizer,
                 "Least score of a query against the image before it")
      ->capture_default_str();
  app.add_option("--max-candidates", command.max_candidates,
                 "Only so many candidates per query, the best ones (default: all)");
  command.VocabularyCommand::define(app);
}

void run(const EvaluateCommand& command) {
  check_output_folder(command.json);
  const Vocabulary vocabulary = load_vocabulary(command.vocabulary);
  const std::vector<StampedPose> truth = read_trajectory(command.truth);
  const std::vector<View> known = views_of(command.known, vocabulary, truth, command);
  const std::vector<View> queries = views_of(command.queries, vocabulary, truth, command);
  const std::vector<Pair> pairs = compare(queries, known, command);
  const auto same = static_cast<std::size_t>(
      std::count_if(pairs.begin(), pairs.end(), [](const Pair& pair) { return pair.same_place; }));
  std::vector<Row> rows;
  for (int step = 4; step <= 20; ++step) rows.push_back(row_at(0.05 * step, pairs, queries.size()));
  print(rows, same, pairs.size());
  write_output(command.json, [&](std::ostream& out) { write_json(out, rows, same); });
}

}  // namespace

void add_evaluate(CLI::App& parent) {
  CLI::App& app = *parent.add_subcommand(
      "evaluate", "Precision and recall of candidates over the similarity threshold");
  const auto command = std::make_shared<EvaluateCommand>();
  define(app, *command);
  app.callback([command] { run(*command); });
}

}  // namespace km
