#include "sample.hpp"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>

namespace viwo::report {

namespace {

Series path(const std::string& name, double drift, bool reference) {
  Series series{.name = name, .x = {}, .y = {}};
  series.reference = reference;
  for (int i = 0; i <= 600; ++i) {
    const double t = i * 2. * std::numbers::pi / 600.;
    const double turn = drift * t;
    const double x = 6. * std::sin(t);
    const double y = 3. * std::sin(2. * t);
    series.x.push_back(std::cos(turn) * x - std::sin(turn) * y);
    series.y.push_back(std::sin(turn) * x + std::cos(turn) * y);
  }
  return series;
}

Series error(const std::string& name, double rate, bool with_band) {
  Series series{.name = name, .x = {}, .y = {}};
  for (int i = 0; i <= 200; ++i) {
    const double s = 0.2 * i;
    series.x.push_back(s);
    series.y.push_back(rate * s + 0.01 * std::sin(s));
    if (!with_band) continue;
    series.y_low.push_back(series.y.back() - 0.3 * rate * s);
    series.y_high.push_back(series.y.back() + 0.3 * rate * s);
  }
  return series;
}

Section summary() {
  Section section{"Summary"};
  section.blocks.push_back(Paragraph{
      "Three estimators saw the same wheel data of 20 simulated runs. The numbers are means over "
      "the runs; each was evaluated after an alignment in yaw and position."});
  section.blocks.push_back(KeyValues{{{"motion", "figure_eight"},
                                      {"runs per variant", 20},
                                      {"path length [m]", 38.2143567},
                                      {"encoder rate [Hz]", 100},
                                      {"diverged runs", 1},
                                      {"wall time [s]", 4.25}}});
  Table table{"Accuracy per variant. Emphasised: the best of each column.",
              {{"variant"},
               {"ATE [m]", {NumberFormat::Style::kFixed, 4}, Best::kLowest},
               {"RPE 10 m [m]", {NumberFormat::Style::kFixed, 4}, Best::kLowest},
               {"RPE 10 m [deg]", {NumberFormat::Style::kFixed, 3}, Best::kLowest},
               {"NEES (6)", {NumberFormat::Style::kFixed, 2}, Best::kNearest, 6.},
               {"real-time factor", {}, Best::kHighest}},
              {}};
  table.rows.push_back({"drive_only", 0.3127, 0.0871, 1.204, 9.31, 912});
  table.rows.push_back({"paper", 0.1482, 0.0416, 0.612, 6.91, 840});
  table.rows.push_back({"full", 0.0213, 0.0067, 0.088, 5.87, 655.5});
  table.rows.push_back({"held_wrong", kNaN, 0.2214, 3.4, 170.75, 950});
  section.blocks.push_back(table);
  section.blocks.push_back(
      Paragraph{"One run of held_wrong diverged: it is counted, and left out of its means.",
                Paragraph::Tone::kWarning});
  return section;
}

Section trajectories() {
  Section section{"Trajectory"};
  Plot plot{.title = "Top view, first run", .x_label = "x [m]", .y_label = "y [m]"};
  plot.equal_axes = true;
  plot.series = {path("reference", 0., true), path("drive_only", 0.035, false),
                 path("paper", 0.015, false), path("full", 0.002, false)};
  plot.caption = "A click on a name hides or shows it; dragging zooms, a double click returns.";
  section.blocks.push_back(plot);
  return section;
}

Section errors() {
  Section section{"Errors"};
  Plot position{.title = "Position error", .x_label = "path length [m]", .y_label = "error [m]"};
  position.half_width = true;
  position.series = {error("drive_only", 0.008, true), error("paper", 0.004, true),
                     error("full", 0.001, true)};
  position.series[1].y[100] = kNaN;
  section.blocks.push_back(position);
  Plot nees{.title = "NEES of the pose", .x_label = "path length [m]", .y_label = "NEES [1]"};
  nees.half_width = true;
  nees.log_y = true;
  nees.series = {error("drive_only", 3., false), error("full", 0.1, false)};
  nees.series[1].draw = Draw::kLinesAndMarkers;
  nees.series[1].dash = Dash::kDotted;
  nees.lines = {{ReferenceLine::Direction::kHorizontal, 6., "expected"},
                {ReferenceLine::Direction::kVertical, 25., "first loop"}};
  section.blocks.push_back(nees);
  return section;
}

Section calibration() {
  Section section{"Calibration"};
  HeatMap map{
      .x = {"r_1", "r_2", "x_2", "y_2", "delta_o2"},
      .y = {"icr_sweep", "straight", "circle"},
      .z = {{0.15, 0.16, 0.04, 0.01, 0.007}, {0.9, 0.92, 1., 1., 0.02}, {0.5, kNaN, 0.7, 0.8, 0.1}},
      .text = {{"0.15", "0.16", "0.04", "0.01", "0.007"},
               {"0.90", "0.92", "1.00", "1.00", "0.02"},
               {"0.50", "", "0.70", "0.80", "0.10"}}};
  map.colour_label = "sigma after / before";
  map.z_min = 0.;
  Plot plot{.title = "What each motion tells", .x_label = "", .y_label = ""};
  plot.heat_map = map;
  section.blocks.push_back(plot);
  return section;
}

Section effort() {
  Section section{"Effort"};
  Plot stages{.title = "Time of an epoch by stage", .x_label = "", .y_label = "time [ms]"};
  stages.half_width = true;
  stages.series = {{.name = "mean",
                    .x = {},
                    .y = {0.05, 0.12, 0.8},
                    .draw = Draw::kBars,
                    .categories = {"propagation", "cloning", "visual_features & more"}},
                   {.name = "95 %",
                    .x = {},
                    .y = {0.07, 0.2, 1.4},
                    .draw = Draw::kBars,
                    .y_low = {0.06, 0.15, kNaN},
                    .y_high = {0.09, 0.3, 1.7},
                    .categories = {"propagation", "cloning", "visual_features & more"}}};
  section.blocks.push_back(stages);
  Plot gates{.title = "Gate", .x_label = "time [s]", .y_label = "rejected [1/s]"};
  gates.half_width = true;
  gates.series = {{.name = "rejected", .x = {0.5, 1.5, 2.5}, .y = {3., 0., 7.}},
                  {.name = "worst", .x = {0.5, 1.5, 2.5}, .y = {30., 10., 20.}}};
  gates.series[0].draw = Draw::kBars;
  gates.series[1].draw = Draw::kMarkers;
  gates.series[1].y_low = {25., 5., 15.};
  gates.series[1].y_high = {35., 15., 25.};
  gates.series[1].opacity = 0.5;
  gates.y_range = {0., 40.};
  section.blocks.push_back(gates);
  section.blocks.push_back(
      Details{"Configuration <resolved>", "\nname: a\nlist: [1, 2] # </pre>\n"});
  return section;
}

Section nasty() {
  Section section{"Odd <characters> & \"quotes\""};
  Plot plot{.title = "</script><script>alert(1)</script>",
            .x_label = "a < b & c > d",
            .y_label = "<b>not bold</b>"};
  plot.series = {{.name = "<i>{{title}}</i> &amp;", .x = {0., 1.}, .y = {0., 1.}},
                 {.name = "<!-- <script>", .x = {0., 1.}, .y = {1., 0.}}};
  section.blocks.push_back(plot);
  section.blocks.push_back(Paragraph{"{{data}} </p></section><img src=x onerror=alert(1)>"});
  section.blocks.push_back(Image{"A drawing", "a circle", "image/svg+xml",
                                 "<svg xmlns='http://www.w3.org/2000/svg' width='60' height='60'>"
                                 "<circle cx='30' cy='30' r='25' fill='#0072b2'/></svg>"});
  return section;
}

}  // namespace

Document sample_document() {
  return {"Wheel odometry: three estimators",
          "figure eight, 20 seeds",
          {summary(), trajectories(), errors(), calibration(), effort(), nasty()}};
}

}  // namespace viwo::report
