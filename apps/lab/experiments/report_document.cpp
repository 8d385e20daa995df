#include "apps/lab/experiments/report_document.hpp"

#include <array>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>
#include <stdexcept>

#include "modules/charts/chart_page.hpp"
#include "modules/charts/html_page.hpp"
#include "modules/core/xml_text.hpp"

namespace km {
namespace {

std::string in_cell(const std::string& text) {
  std::string escaped;
  for (const char c : text) escaped += c == '|' ? std::string("\\|") : std::string(1, c);
  return escaped;
}

std::string cell_text(const ReportCell& cell) {
  const bool strong = cell.style != ReportCell::Style::kPlain && !cell.text.empty();
  const std::string text = strong ? "**" + in_cell(cell.text) + "**" : in_cell(cell.text);
  return cell.paper.empty() ? text : text + " (" + in_cell(cell.paper) + ')';
}

// Markdown has one row of headings, so a group's title precedes each of its columns' titles.
std::vector<std::string> headings(const ReportTable& table) {
  std::vector<std::string> titles;
  std::size_t column = 0;
  for (const ColumnGroup& group : table.groups)
    for (std::size_t k = 0; k < group.columns && column < table.columns.size(); ++k, ++column)
      titles.push_back(group.title.empty() ? table.columns[column]
                                           : group.title + ": " + table.columns[column]);
  return table.groups.empty() ? table.columns : titles;
}

class MarkdownWriter {
 public:
  void operator()(const ReportParagraph& paragraph) { out_ << paragraph.text << "\n\n"; }

  void operator()(const ReportTable& table) {
    out_ << "**" << table.caption << "**\n\n|";
    for (const std::string& title : headings(table)) out_ << ' ' << in_cell(title) << " |";
    out_ << "\n|";
    for (std::size_t c = 0; c < table.columns.size(); ++c)
      out_ << (c == 0 || table.words ? " --- |" : " ---: |");
    out_ << '\n';
    for (const auto& row : table.rows) {
      out_ << '|';
      for (const ReportCell& cell : row) out_ << ' ' << cell_text(cell) << " |";
      out_ << '\n';
    }
    out_ << '\n';
    if (!table.note.empty()) out_ << table.note << "\n\n";
  }

  void operator()(const ReportFigures& row) {
    for (const ReportFigure& figure : row.figures)
      if (figure.plots.empty())
        out_ << "![" << figure.caption << "](figures/" << figure.name << ".png)\n\n";
      else
        out_ << '[' << figure.caption << "](report.html#figure-" << figure.name << ")\n\n";
  }

  void operator()(const ReportProvenance& provenance) {
    if (!provenance.common.empty()) out_ << provenance.common << "\n\n";
    for (const std::string& line : provenance.open) out_ << line << "\n\n";
    if (provenance.rows.empty()) return;
    out_ << "<details><summary>" << provenance.rows.size() << " steps</summary>\n\n";
    for (const auto& row : provenance.rows)
      out_ << "- " << row.what << ": `" << row.command << "`; " << row.when
           << (row.machine.empty() ? "" : "; ") << row.machine << '\n';
    out_ << "\n</details>\n\n";
  }

  void write(const ReportSection& section) {
    out_ << "## " << section.title << "\n\n";
    for (const ReportBlock& block : section.blocks) std::visit(*this, block);
  }

  std::string text() const { return out_.str(); }

 private:
  std::ostringstream out_;
};

}  // namespace

void ReportSection::add(ReportBlock block) {
  const auto* const table = std::get_if<ReportTable>(&block);
  if (table == nullptr || !table->rows.empty()) blocks.push_back(std::move(block));
}

std::string to_markdown(const ReportDocument& document) {
  MarkdownWriter writer;
  for (const ReportSection& section : document.sections) writer.write(section);
  return "# " + document.title + "\n\n" + document.lead + "\n\n" + writer.text();
}

namespace {

constexpr const char* kStyle = R"(
:root { --ink: #1c2330; --soft: #68707d; --line: #e2e5ea; --accent: #1f5fa8; --band: #f6f8fa; }
* { box-sizing: border-box; }
body { margin: 0; color: var(--ink); background: #fff;
  font: 16px/1.55 system-ui, -apple-system, "Segoe UI", Roboto, "Noto Sans", sans-serif; }
main { max-width: 1120px; margin: 0 auto; padding: 48px 28px 96px; }
h1 { font-size: 30px; line-height: 1.2; margin: 0 0 10px; letter-spacing: -.01em; }
h2 { font-size: 22px; margin: 64px 0 12px; padding-top: 14px; border-top: 2px solid var(--ink); }
p { max-width: 78ch; margin: 12px 0; }
.lead { color: var(--soft); font-size: 17px; }
nav { margin: 26px 0 0; padding: 14px 18px; background: var(--band); border-radius: 8px; }
nav a { color: var(--accent); text-decoration: none; margin-right: 22px; white-space: nowrap; }
nav a:hover { text-decoration: underline; }
.scroll { overflow-x: auto; margin: 0 0 26px; }
table { border-collapse: collapse; font-size: 14.5px; font-variant-numeric: tabular-nums; }
.caption { font-weight: 600; font-size: 14.5px; margin: 26px 0 8px; }
th, td { padding: 6px 12px; text-align: right; white-space: nowrap; vertical-align: top; }
th { font-weight: 600; color: var(--soft); vertical-align: bottom; }
th:first-child, td:first-child { text-align: left; padding-left: 2px; }
thead tr:last-child th { border-bottom: 1px solid var(--ink); }
thead th.group { text-align: center; border-bottom: 1px solid var(--line); color: var(--ink); }
tbody td { border-bottom: 1px solid var(--line); }
tbody tr:hover { background: var(--band); }
.paper { display: block; color: var(--soft); font-size: 12.5px; font-weight: 400;
  line-height: 1.3; }
.best { font-weight: 700; }
.met { color: #14713d; font-weight: 600; }
.missed { color: #b3261e; font-weight: 600; }
table.words { width: 100%; }
.words td, .words th { text-align: left; white-space: normal; }
.words td:first-child, .words th:first-child { width: 40%; }
.note { color: var(--soft); font-size: 13.5px; margin: -14px 0 26px; }
.figures { display: grid; grid-template-columns: repeat(auto-fit, minmax(400px, 1fr)); gap: 26px;
  margin: 26px 0; }
.figures.one { grid-template-columns: minmax(300px, 860px); }
figure { margin: 0; }
figure img { width: 100%; height: auto; display: block; }
figure img, .plots { border: 1px solid var(--line); border-radius: 6px; }
.plots { padding: 8px 12px; }
.plot + .plot { margin-top: 16px; }
figcaption { color: var(--soft); font-size: 13.5px; margin-top: 6px; }
details { margin: 22px 0; border: 1px solid var(--line); border-radius: 8px; padding: 8px 14px; }
summary { cursor: pointer; color: var(--accent); font-size: 14.5px; }
details table { font-size: 12.5px; margin-top: 8px; }
details td, details th { white-space: normal; text-align: left; }
code { font: 12px/1.45 ui-monospace, "DejaVu Sans Mono", monospace; overflow-wrap: anywhere; }
@media print { details { break-inside: auto; } nav { display: none; } tr { break-inside: avoid; } }
)";

std::string contents_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error(file.string() + ": cannot be read");
  return {std::istreambuf_iterator<char>(in), {}};
}

const char* style_class(ReportCell::Style style) {
  constexpr std::array kClasses = {"", " class=\"best\"", " class=\"met\"", " class=\"missed\""};
  return kClasses.at(static_cast<std::size_t>(style));
}

class HtmlWriter {
 public:
  void operator()(const ReportParagraph& paragraph) {
    out_ << "<p>" << xml_escaped(paragraph.text) << "</p>\n";
  }

  void operator()(const ReportTable& table) {
    out_ << "<p class=\"caption\">" << xml_escaped(table.caption)
         << "</p>\n<div class=\"scroll\"><table" << (table.words ? " class=\"words\"" : "")
         << ">\n<thead>\n";
    if (!table.groups.empty()) {
      out_ << "<tr>";
      for (const ColumnGroup& group : table.groups)
        out_ << "<th" << (group.title.empty() ? "" : " class=\"group\"") << " colspan=\""
             << group.columns << "\">" << xml_escaped(group.title) << "</th>";
      out_ << "</tr>\n";
    }
    out_ << "<tr>";
    for (const std::string& column : table.columns)
      out_ << "<th>" << xml_escaped(column) << "</th>";
    out_ << "</tr>\n</thead>\n<tbody>\n";
    for (const auto& row : table.rows) {
      out_ << "<tr>";
      for (const ReportCell& cell : row) write(cell);
      out_ << "</tr>\n";
    }
    out_ << "</tbody>\n</table></div>\n";
    if (!table.note.empty()) out_ << "<p class=\"note\">" << xml_escaped(table.note) << "</p>\n";
  }

  void operator()(const ReportFigures& row) {
    out_ << "<div class=\"figures" << (row.figures.size() == 1 ? " one" : "") << "\">\n";
    for (const ReportFigure& figure : row.figures) {
      out_ << "<figure>\n";
      if (!figure.plots.empty())
        place(figure);
      else
        out_ << "<img alt=\"" << xml_escaped(figure.caption) << "\" src=\""
             << data_uri("image/png", contents_of(figure.png)) << "\"/>\n";
      out_ << "<figcaption>" << xml_escaped(figure.caption) << "</figcaption>\n</figure>\n";
    }
    out_ << "</div>\n";
  }

  void operator()(const ReportProvenance& provenance) {
    for (const std::string& line : provenance.open) out_ << "<p>" << xml_escaped(line) << "</p>\n";
    if (!provenance.common.empty()) out_ << "<p>" << xml_escaped(provenance.common) << "</p>\n";
    if (provenance.rows.empty()) return;
    out_ << "<details><summary>" << provenance.rows.size()
         << " steps</summary>\n<table>\n<thead><tr>"
            "<th>step</th><th>command</th><th>when</th><th>machine, commit</th></tr></thead>\n"
            "<tbody>\n";
    for (const auto& row : provenance.rows)
      out_ << "<tr><td>" << xml_escaped(row.what) << "</td><td><code>" << xml_escaped(row.command)
           << "</code></td><td>" << xml_escaped(row.when) << "</td><td>" << xml_escaped(row.machine)
           << "</td></tr>\n";
    out_ << "</tbody></table></details>\n";
  }

  void write(const ReportSection& section) {
    out_ << "<section id=\"" << section.id << "\">\n<h2>" << xml_escaped(section.title)
         << "</h2>\n";
    for (const ReportBlock& block : section.blocks) std::visit(*this, block);
    out_ << "</section>\n";
  }

  std::string text() const { return out_.str() + plot_scripts(plots_); }

 private:
  // Scripts draw its plots there.
  void place(const ReportFigure& figure) {
    const std::string id = "figure-" + figure.name;
    out_ << "<div class=\"plots\" id=\"" << id << "\"></div>\n";
    plots_[id] = figure.plots;
  }

  void write(const ReportCell& cell) {
    out_ << "<td" << style_class(cell.style) << '>' << xml_escaped(cell.text);
    if (!cell.paper.empty())
      out_ << "<span class=\"paper\">" << xml_escaped(cell.paper) << "</span>";
    out_ << "</td>";
  }

  std::ostringstream out_;
  std::map<std::string, std::vector<Plot>> plots_;
};

}  // namespace

std::string to_html(const ReportDocument& document) {
  std::ostringstream out;
  out << "<main>\n<h1>" << xml_escaped(document.title) << "</h1>\n<p class=\"lead\">"
      << xml_escaped(document.lead) << "</p>\n<nav>";
  for (const ReportSection& section : document.sections)
    out << "<a href=\"#" << section.id << "\">" << xml_escaped(section.title) << "</a> ";
  out << "</nav>\n";
  HtmlWriter writer;
  for (const ReportSection& section : document.sections) writer.write(section);
  out << writer.text() << "</main>\n";
  return html_page({.title = document.title, .styles = {kStyle}, .body = out.str()});
}

}  // namespace km
