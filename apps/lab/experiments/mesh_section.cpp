#include <array>
#include <cmath>

#include "apps/lab/experiments/paper_results.hpp"
#include "apps/lab/experiments/report.hpp"
#include "modules/core/text_table.hpp"

namespace km {
namespace {

// The meshes of the robots, then that of all together.
struct NamedMesh {
  std::string name;
  MeshPair mesh;
};

std::vector<NamedMesh> meshes_of(const WorldResults& results) {
  std::vector<NamedMesh> meshes;
  for (const RobotNumbers& robot : results.robots) meshes.push_back({robot.name, robot.mesh});
  meshes.push_back({"merged", results.mesh});
  return meshes;
}

std::optional<double> centimetres(const std::optional<double>& metres) {
  return metres ? std::optional<double>(100.0 * *metres) : std::nullopt;
}

// Marks the better one.
void mark_better(ReportCell& before, ReportCell& after, const std::optional<double>& b,
                 const std::optional<double>& a, bool less_is_better) {
  if (!a || !b) return;
  const bool after_is_better = less_is_better ? *a < *b : *a > *b;
  (after_is_better ? after : before).style = ReportCell::Style::kBest;
}

void add_pair(std::vector<ReportCell>& row, const std::optional<double>& before,
              const std::optional<double>& after, int decimals, bool less_is_better) {
  ReportCell b{number_text(before, decimals)}, a{number_text(after, decimals)};
  mark_better(b, a, before, after, less_is_better);
  row.push_back(b);
  row.push_back(a);
}

ReportTable error_table(const std::vector<ReportInput::World>& worlds) {
  ReportTable table{.caption = "Fig. 7 as numbers: mesh error before and after the correction [cm]",
                    .groups = {{"", 1},
                               {"as the paper measures it", 2},
                               {"without what no robot saw", 2},
                               {"the way back", 2}},
                    .columns = {"mesh", "before", "after", "before", "after", "before", "after"}};
  for (const auto& [config, results] : worlds)
    for (const NamedMesh& mesh : meshes_of(*results)) {
      std::vector<ReportCell> row{{config->title + ", " + mesh.name}};
      const auto& [before, after] = mesh.mesh;
      add_pair(row, centimetres(before.error_m), centimetres(after.error_m), 2, true);
      add_pair(row, centimetres(before.seen_error_m), centimetres(after.seen_error_m), 2, true);
      add_pair(row, centimetres(before.back_error_m), centimetres(after.back_error_m), 2, true);
      table.rows.push_back(std::move(row));
    }
  table.note =
      "Mean distance from points of the true mesh, up to 1000 a square metre and two millions in "
      "all, to the nearest of the estimated one, after ICP of all together; only true points "
      "within 0.5 m of it count. The middle leaves out true surface past the mesh's rim or behind "
      "it. The way back: from points of the estimated mesh to the true one. Several copies of a "
      "surface, spread about it, have a nearer one to most true points than copies that agree: of "
      "a merged mesh only the way back distinguishes the two.";
  return table;
}

Plot error_chart(const ReportInput::World& world) {
  constexpr auto kBars = PlotSeries::Style::kBars;
  Plot chart{.title = world.config->title,
             .y_label = "mesh error [cm]",
             .series = {{"before", {}, PlotSeries::kGrey, kBars}, {"after", {}, 0, kBars}}};
  for (const auto& [name, mesh] : meshes_of(*world.results)) {
    const auto x = static_cast<double>(chart.groups.size());
    chart.groups.push_back(name);
    chart.series[0].points.push_back({x, 100.0 * mesh.before.seen_error_m.value_or(NAN)});
    chart.series[1].points.push_back({x, 100.0 * mesh.after.seen_error_m.value_or(NAN)});
  }
  return chart;
}

ReportFigures charts(const std::vector<ReportInput::World>& worlds) {
  ReportFigures row;
  for (const auto& world : worlds)
    row.figures.push_back({.name = "mesh-error-" + world.config->name,
                           .caption = world.config->title + ": without what no robot saw.",
                           .plots = {error_chart(world)}});
  return row;
}

ReportFigures pictures(const ReportInput& input, const std::vector<ReportInput::World>& worlds) {
  ReportFigures row;
  for (const auto& world : worlds)
    for (const bool corrected : {false, true}) {
      const auto png = picture_file(*world.config, corrected, input.paths());
      if (!input.has(png.stem().string())) continue;
      row.figures.push_back({.name = png.stem().string(),
                             .caption = world.config->title + ", all robots, " +
                                        (corrected ? "after" : "before") + " the correction.",
                             .png = png});
    }
  return row;
}

void add_target(ReportInput& input, const ReportInput::World& world, const char* what,
                const std::optional<double>& before, const std::optional<double>& after,
                const char* unit, bool less_is_better) {
  if (!before || !after) return;
  const bool met = less_is_better ? *after < *before : *after > *before;
  input.add_target({what, world.config->title,
                    less_is_better ? "less after the correction" : "more after the correction",
                    fixed(*before, 2) + " to " + fixed(*after, 2) + unit, met, true});
}

ReportTable labels_table(const std::vector<ReportInput::World>& worlds) {
  ReportTable table{
      .caption = "Table III: right labels before and after the correction [%]",
      .groups = {{"", 1}, {"as the paper measures it", 2}, {"without what no robot saw", 2}},
      .columns = {"mesh", "before", "after", "before", "after"}};
  for (const auto& [config, results] : worlds) {
    const PaperLabels* const paper = paper_labels(config->name);
    const std::vector<NamedMesh> meshes = meshes_of(*results);
    for (std::size_t m = 0; m < meshes.size(); ++m) {
      std::vector<ReportCell> row{{config->title + ", " + meshes[m].name}};
      const auto& [before, after] = meshes[m].mesh;
      add_pair(row, before.labels_percent, after.labels_percent, 2, false);
      add_pair(row, before.seen_labels_percent, after.seen_labels_percent, 2, false);
      if (paper != nullptr && meshes.size() == paper->before_percent.size()) {
        row[1].paper = fixed(paper->before_percent[m], 2);
        row[2].paper = fixed(paper->after_percent[m], 2);
      }
      table.rows.push_back(std::move(row));
    }
  }
  table.note =
      "Of the true points that count for the mesh error, those within 0.2 m of the mesh "
      "whose nearest point has their label.";
  return table;
}

bool has_meshes(const ReportInput::World& world) {
  return world.results->mesh.before.error_m || world.results->mesh.after.error_m;
}

bool has_labels(const ReportInput::World& world) {
  return world.results->mesh.before.labels_percent || world.results->mesh.after.labels_percent;
}

std::vector<ReportInput::World> with_meshes(std::vector<ReportInput::World> worlds) {
  std::erase_if(worlds, [](const auto& world) { return !has_meshes(world); });
  return worlds;
}

}  // namespace

std::optional<ReportSection> mesh_section(ReportInput& input) {
  const auto all = input.worlds(input.config().mesh_worlds);
  const auto worlds = with_meshes(all);  // EuRoC's own images have no true mesh
  ReportFigures drawn = pictures(input, all);
  if (worlds.empty() && drawn.figures.empty()) return std::nullopt;
  ReportSection section{.id = "mesh", .title = "Meshes"};
  section.add(ReportParagraph{
      "Each robot's mesh as its odometry built it, moved as a whole into the team's frame, and the "
      "same mesh after local mesh optimisation bent it to the team's solution; and all robots' "
      "meshes together. The paper shows its errors as bars without numbers."});
  if (!worlds.empty()) {
    section.add(charts(worlds));
    section.add(error_table(worlds));
  }
  if (!drawn.figures.empty()) section.add(std::move(drawn));
  for (const auto& world : worlds) {
    const auto& [before, after] = world.results->mesh;
    add_target(input, world, "error of the merged mesh", centimetres(before.error_m),
               centimetres(after.error_m), " cm", true);
    add_target(input, world, "error of the merged mesh, without what no robot saw",
               centimetres(before.seen_error_m), centimetres(after.seen_error_m), " cm", true);
  }
  return section;
}

std::optional<ReportSection> semantics_section(ReportInput& input) {
  auto worlds = with_meshes(input.worlds(input.config().semantics_worlds));
  std::erase_if(worlds, [](const auto& world) { return !has_labels(world); });
  if (worlds.empty()) return std::nullopt;
  ReportSection section{.id = "semantics", .title = "Labels"};
  section.add(ReportParagraph{
      "Labels come from the simulator's images of classes, as in the paper; each vertex of the "
      "mesh has the most likely one of the labels of all its views. The paper has no truth for the "
      "Vicon rooms; ours are rendered, so there is one."});
  section.add(labels_table(worlds));
  for (const auto& world : worlds) {
    const auto& [before, after] = world.results->mesh;
    add_target(input, world, "right labels of the merged mesh", before.labels_percent,
               after.labels_percent, " %", false);
    if (const PaperLabels* const paper = paper_labels(world.config->name);
        paper != nullptr && after.labels_percent)
      input.add_target({"right labels of the merged mesh, corrected", world.config->title,
                        "at least " + fixed(paper->after_percent.back(), 2) + " %, the paper's",
                        fixed(*after.labels_percent, 2) + " %",
                        *after.labels_percent >= paper->after_percent.back(), true});
  }
  return section;
}

}  // namespace km
