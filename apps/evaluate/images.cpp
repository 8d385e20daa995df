#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>

#include "apps/evaluate/commands.hpp"
#include "apps/output_file.hpp"
#include "apps/stage_progress.hpp"
#include "modules/evaluation/images/image_figure.hpp"
#include "modules/evaluation/images/image_statistics.hpp"
#include "modules/sensors/node/euroc_rig.hpp"

namespace km {
namespace {

namespace fs = std::filesystem;

struct ImagesCommand {
  std::filesystem::path dataset;  // EuRoC/ASL folder.
  std::filesystem::path compare;  // Folder of a second recording; empty: no comparison.
  EurocOptions part;              // Part of the recording.
  // Part of the second recording; default: `part`.
  std::optional<double> compare_from_s, compare_to_s;
  // Further part in which the camera stands still; absent: none. It applies to the second recording
  // only if that has no part of its own.
  std::optional<double> still_from_s, still_to_s;
  ImageStatisticsOptions options;
  std::filesystem::path json;  // Not written if empty.
};

template <typename Use>
void for_each_pair(EurocReader& reader, const std::string& what, const Use& use) {
  StageProgress progress;
  const auto total = static_cast<double>(reader.pair_count());
  for (double done = 0.0; const auto packet = reader.next(); ++done) {
    progress(what, done / total);
    use(*packet->frame);
  }
}

// The part of a recording between the two [s since its first stereo pair]; nullopt without either.
std::optional<EurocOptions> part_of(const std::optional<double>& from_s,
                                    const std::optional<double>& to_s) {
  if (!from_s && !to_s) return std::nullopt;
  EurocOptions part;
  part.from_s = from_s.value_or(part.from_s);
  part.to_s = to_s.value_or(part.to_s);
  return part;
}

std::vector<ImageFigure> figures_of(const fs::path& dataset, const EurocOptions& part,
                                    const std::optional<EurocOptions>& still,
                                    const ImageStatisticsOptions& options) {
  EurocReader reader = open_euroc(dataset, part);
  ImageStatistics statistics(reader.rig().stereo, options);
  for_each_pair(reader, dataset.string(), [&](const StereoFrame& frame) { statistics.add(frame); });
  if (still) {
    EurocReader rest = open_euroc(dataset, *still);
    for_each_pair(rest, dataset.string() + ", standing still",
                  [&](const StereoFrame& frame) { statistics.add_still(frame); });
  }
  if (!reader.report().empty())
    std::cerr << dataset.string() << ":\n" << to_string(reader.report());
  return statistics.figures();
}

void run(const ImagesCommand& command) {
  check_output_folder(command.json);
  const auto still = part_of(command.still_from_s, command.still_to_s);
  const auto own = part_of(command.compare_from_s, command.compare_to_s);
  const EurocOptions& other_part = own ? *own : command.part;
  // Opened only to report its errors now, instead of minutes later after the first recording.
  if (!command.compare.empty()) static_cast<void>(open_euroc(command.compare, other_part));
  const auto figures = figures_of(command.dataset, command.part, still, command.options);
  std::vector<ImageFigure> other;
  if (command.compare.empty()) {
    std::cout << to_table(figures);
  } else {
    other = figures_of(command.compare, other_part, own ? std::nullopt : still, command.options);
    std::cout << to_comparison(figures, other, command.dataset.string(), command.compare.string());
  }
  write_output(command.json, [&](std::ostream& out) {
    Json json = {{"dataset", command.dataset.string()}, {"figures", to_json(figures)}};
    if (!command.compare.empty()) {
      json["compared_with"] = command.compare.string();
      json["compared_figures"] = to_json(other);
      json["comparison"] = comparison_json(figures, other);
    }
    out << json_text(json);
  });
}

constexpr const char* kImagesDetails =
    R"(Statistics of the images of a recording: corners, how long they can be tracked, how well they
are found in the other camera, gradients, grey levels, exposure, blur and noise

Tracking depends on motion most of all: compare two recordings by the rows "flow A-B px",
frames of like median flow. Rows that differ by more than 25 % are marked. Noise over time
needs the camera to stand still for a second; --still-from and --still-to state when.

Examples:
  kimera_multi_evaluate images --dataset MH_01_easy --to 15 --still-from 21 --still-to 25.5
  kimera_multi_evaluate images --dataset V1_01_easy --compare simulated --compare-from 5)";

void define(CLI::App& app, ImagesCommand& command) {
  app.add_option("--dataset", command.dataset, "EuRoC/ASL folder with stereo images")->required();
  app.add_option("--compare", command.compare, "Another one: its figures beside, and the ratios");
  app.add_option("--from", command.part.from_s, "Look from here on [s since the first stereo pair]")
      ->capture_default_str();
  app.add_option("--to", command.part.to_s, "Look up to here [s]; default: the end");
  app.add_option("--compare-from", command.compare_from_s,
                 "Look at the other from here on [s]; default: the window of --from and --to");
  app.add_option("--compare-to", command.compare_to_s,
                 "Look at the other up to here [s]; default: the end if --compare-from is given");
  app.add_option("--still-from", command.still_from_s,
                 "Also look for standing still from here on [s]");
  app.add_option("--still-to", command.still_to_s, "Also look for standing still up to here [s]");
  app.add_option("--stride", command.options.stride,
                 "Interval of the pairs at which ORB and stereo are matched and KLT tracks start")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--json", command.json, "Also write the figures to this file, as JSON");
}

}  // namespace

void add_images(CLI::App& parent) {
  CLI::App& app = *parent.add_subcommand("images", kImagesDetails);
  const auto command = std::make_shared<ImagesCommand>();
  define(app, *command);
  app.callback([command] { run(*command); });
}

}  // namespace km
