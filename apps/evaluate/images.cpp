#include <CLI/CLI.hpp>
#include <filesystem>
#include <iostream>
#include <limits>
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

// Part of a recording [s since its first stereo pair].
struct RecordingWindow {
  double from_s = 0.0;
  double to_s = std::numeric_limits<double>::infinity();
};

struct ImagesCommand {
  std::filesystem::path dataset;  // EuRoC/ASL folder.
  std::filesystem::path compare;  // Folder of a second recording; empty: no comparison.
  RecordingWindow window;
  // Window of the second recording; default: `window`.
  std::optional<double> compare_from_s;
  std::optional<double> compare_to_s;
  // Further window in which the camera stands still; absent: none. It applies to the second
  // recording only if that has no window of its own.
  std::optional<double> still_from_s;
  std::optional<double> still_to_s;
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

EurocOptions options_of(const RecordingWindow& window) {
  EurocOptions options;
  options.from_s = window.from_s;
  options.to_s = window.to_s;
  return options;
}

std::vector<ImageFigure> figures_of(const fs::path& dataset, const RecordingWindow& window,
                                    const std::optional<RecordingWindow>& still,
                                    const ImageStatisticsOptions& options) {
  EurocReader reader = open_euroc(dataset, options_of(window));
  ImageStatistics statistics(reader.rig().stereo, options);
  for_each_pair(reader, dataset.string(), [&](const StereoFrame& frame) { statistics.add(frame); });
  if (still) {
    EurocReader rest = open_euroc(dataset, options_of(*still));
    for_each_pair(rest, dataset.string() + ", standing still",
                  [&](const StereoFrame& frame) { statistics.add_still(frame); });
  }
  if (!reader.report().empty())
    std::cerr << dataset.string() << ":\n" << to_string(reader.report());
  return statistics.figures();
}

std::optional<RecordingWindow> still_window(const ImagesCommand& command) {
  if (!command.still_from_s && !command.still_to_s) return std::nullopt;
  RecordingWindow window;
  window.from_s = command.still_from_s.value_or(window.from_s);
  window.to_s = command.still_to_s.value_or(window.to_s);
  return window;
}

bool has_own_window(const ImagesCommand& command) {
  return command.compare_from_s || command.compare_to_s;
}

RecordingWindow window_of_other(const ImagesCommand& command) {
  if (!has_own_window(command)) return command.window;
  RecordingWindow window;
  window.from_s = command.compare_from_s.value_or(window.from_s);
  window.to_s = command.compare_to_s.value_or(window.to_s);
  return window;
}

std::vector<ImageFigure> figures_of_other(const ImagesCommand& command) {
  const auto still = has_own_window(command) ? std::nullopt : still_window(command);
  return figures_of(command.compare, window_of_other(command), still, command.options);
}

void run(const ImagesCommand& command) {
  check_output_folder(command.json);
  // Opened only to report its errors now, instead of minutes later after the first recording.
  if (!command.compare.empty())
    static_cast<void>(open_euroc(command.compare, options_of(window_of_other(command))));
  const auto figures =
      figures_of(command.dataset, command.window, still_window(command), command.options);
  std::vector<ImageFigure> other;
  if (command.compare.empty()) {
    std::cout << to_table(figures);
  } else {
    other = figures_of_other(command);
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
    "Statistics of the images of a recording: corners, how long they can be tracked, how well "
    "they\nare found in the other camera, gradients, grey levels, exposure, blur and "
    "noise\n\nTracking depends on motion most of all: compare two recordings by the rows \"flow "
    "A-B px\",\n"
    "Tracking depends on motion most of all: compare two recordings by the rows \"flow A-B px\",\n"
    "frames of like median flow. Rows that differ by more than 25 % are marked. Noise over time\n"
    "needs the camera to stand still for a second; --still-from and --still-to state when.\n\n"
    "Examples:\n"
    "  kimera_multi_evaluate images --dataset MH_01_easy --to 15 --still-from 21 --still-to 25.5\n"
    "  kimera_multi_evaluate images --dataset V1_01_easy --compare simulated --compare-from 5";

void define(CLI::App& app, ImagesCommand& command) {
  app.add_option("--dataset", command.dataset, "EuRoC/ASL folder with stereo images")->required();
  app.add_option("--compare", command.compare, "Another one: its figures beside, and the ratios");
  app.add_option("--from", command.window.from_s,
                 "Look from here on [s since the first stereo pair]")
      ->capture_default_str();
  app.add_option("--to", command.window.to_s, "Look up to here [s]; default: the end");
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
