// The commands that turn files into others, without a run.
#include <iostream>
#include <string>

#include "command_line.hpp"
#include "viwo/eval/accuracy.hpp"
#include "viwo/eval/hints.hpp"
#include "viwo/eval/json.hpp"
#include "viwo/export/export_calibration.hpp"
#include "viwo/files/files.hpp"
#include "viwo/log/tum.hpp"
#include "viwo/setup/input_files.hpp"

namespace viwo::app {

int export_command(const Arguments& arguments) {
  const CalibrationFile calibration = read_calibration(arguments.positional[0]);
  const exports::Exported exported = exports::export_calibration(calibration, arguments.to);
  if (arguments.out) {
    refuse_to_replace(*arguments.out, {arguments.positional[0]});
    files::write_text(*arguments.out, exported.text, files::Appears::kWholeBesideOthers);
  } else {
    std::cout << exported.text;
  }
  const std::string doubts = doubts_of(calibration);
  if (!doubts.empty()) std::cerr << "warning: " << doubts << "\n";
  for (const std::string& line : exported.lost) {
    std::cerr << "not in " << arguments.to << ": " << line << "\n";
  }
  return 0;
}

int evaluate_command(const Arguments& arguments) {
  eval::Options options;
  bool known = false;
  for (const auto mode : {eval::Alignment::kNone, eval::Alignment::kStart,
                          eval::Alignment::kYawPosition, eval::Alignment::kSe3}) {
    if (arguments.align != eval::name(mode)) continue;
    options.alignment = mode;
    known = true;
  }
  if (!known) {
    throw InputError("--align " + arguments.align + ": known are none, start, yaw_position, se3");
  }
  constexpr const char* kResult = "evaluation.json";
  if (arguments.out) {
    refuse_to_replace(*arguments.out / kResult, {arguments.reference, arguments.estimate});
  }
  options.max_reference_gap_s = arguments.max_gap_s;
  const Trajectory reference = log::read_tum(arguments.reference);
  const Trajectory estimate = log::read_tum(arguments.estimate);
  const eval::Accuracy accuracy = eval::evaluate(reference, estimate, options);
  const std::string text = json_text(eval::to_json(accuracy));
  std::cout << text;
  for (const std::string& line : eval::hints(reference, estimate, options, accuracy)) {
    std::cerr << "warning: " << line << "\n";
  }
  if (arguments.out) {
    files::make_folder(*arguments.out);
    files::write_text(*arguments.out / kResult, text, files::Appears::kWholeBesideOthers);
  }
  return 0;
}

}  // namespace viwo::app
