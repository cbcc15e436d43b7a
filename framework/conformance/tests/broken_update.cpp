// An update with one mistake, which its name says; without it it is right: the base does not lift
// off the ground, whose height is estimated, and now and then a mark is put on it.
#include <array>
#include <cmath>
#include <csignal>
#include <optional>
#include <stdexcept>

#include "viwo/api/plugin.hpp"

/// "broken_<defect>": of the library that this is linked into.
extern const char kPluginName[];

namespace other {

/// What somebody has made of the encoder samples of another viwo.
struct Encoders {
  std::int64_t t_ns = 0;
  double rate_rad_per_s = 0.;
};

/// Of a kind of its own.
struct Range {
  std::int64_t t_ns = 0;
  double range_m = 0.;
};

}  // namespace other

VIWO_SAMPLE(other::Encoders, "encoders", 1, &other::Encoders::t_ns,
            &other::Encoders::rate_rad_per_s);
VIWO_SAMPLE(other::Range, "range", 1, &other::Range::t_ns, &other::Range::range_m);

namespace viwo {
namespace {

bool is(std::string_view defect) {
  return std::string_view(kPluginName).substr(std::string_view("broken_").size()) == defect;
}

struct Params {
  double sigma_height_m = 0.1;

  void bind(ParamBinder& b) {
    b(VIWO_PARAM(sigma_height_m), {.unit = "m", .above = 0., .help = "how flat the ground is"});
  }
};

constexpr int kMarks = 3;

int shared_calls = 0, shared_declarations = 0;

class Broken final : public Update {
 public:
  Broken(const Params& params, const HostServices& /*services*/)
      : sigma_m_(params.sigma_height_m) {}

  void declare(Declarations& host) override {
    host_ = &host;
    if (is("no_camera") && host.rig().cameras().size() < 2) throw InputError("needs two cameras");
    if (is("declare_throws")) throw std::out_of_range("no wheel set");
    declare_ground(host);
    marks_ = host.room({.name = "broken.marks", .blocks = kMarks, .entries = 1});
    camera_ = declare_camera(host, 0).extrinsics;
    poses_ = host.stream({.type = &sample_type<PoseSample>()});
    if (is("layout")) host.stream({.type = &sample_type<other::Encoders>()});
    if (is("foreign")) host.stream({.type = &sample_type<other::Range>()});
    if (is("wants_block")) host.block("gnss0.p_AinI");
  }

  void start(const UpdateSetup& /*setup*/) override {
    if (is("late")) host_->block({.name = "broken.late"});
    if (is("cannot_start")) throw InputError("works with four clones or less");
  }

  void update(const FilterView& filter, const EpochData& data, FactorSink& sink) override {
    ++shared_calls;
    if (is("throws") && data.imu.size() < 2) throw std::out_of_range("no IMU");
    if (is("throws_int") && data.imu.empty()) throw 42;
    if (is("crash") && data.imu.empty()) std::raise(SIGSEGV);
    if (is("other_samples")) data.samples<EncoderSample>(poses_);
    add_height(filter, sink);
    added_ = std::nullopt;
    if (data.samples<PoseSample>(poses_).empty()) return;
    if (is("foreign_room")) sink.add_block({0}, std::array{0., 0., 0.});
    const RoomId room = is("no_room") ? RoomId{} : marks_;
    added_ = sink.add_block(room, std::array{filter.imu.p_IinG.x()});
    if (is("assumes_room")) added_.value();
    if (!added_ || is("undetermined")) return;
    InformationFactor& factor = sink.add_information();
    factor.columns.add(filter.block(*added_).column(), 1);
    factor.columns.add(kPositionColumn, 1);
    factor.Lambda.topLeftCorner<2, 2>() << 100., 0., -100., 100.;
    factor.eta.head<2>().setZero();
  }

  void settle(const FilterView& filter, BlockEdits& edits) override {
    if (is("drops_others")) edits.drop(camera_);
    if (!added_ || !exists(filter, *added_)) return;
    if (is("rewrites_others")) rewrite(filter, {0}, edits);
    rewrite(filter, *added_, edits);
    if (last_) edits.drop(*last_);
    if (last_ && is("drops_twice")) edits.drop(*last_);
    last_ = added_;
  }

  void rejections(std::vector<RejectionCount>& out) const override {
    if (is("rejections")) out.push_back({"", 3, ""});
  }

 private:
  void declare_ground(Declarations& host) {
    BlockSpec ground{.name = "broken.ground"};
    if (is("rotation")) {
      ground.add_rotation({"a", "b", "c"}, 2. * Eigen::Matrix3d::Identity(), {0.1, 0.1, 0.1});
    }
    if (is("few_entries")) ground.rotations = 1;
    const double wrong = is("shared_declarations") ? 0.01 * ++shared_declarations : 0.;
    ground.add(is("no_name") ? "" : is("name_taken") ? "r_1" : "height", "m", 0., 0.1 + wrong);
    if (is("name_twice")) ground.add("height", "m", 0., 0.1);
    ground_ = host.block(ground);
    if (is("twice")) {
      BlockSpec again{.name = "broken.ground"};
      host.block(again.add("height", "cm", 0., 0.1));
    }
  }

  void add_height(const FilterView& filter, FactorSink& sink) {
    ResidualFactor& factor = sink.add_residual();
    factor.columns.add(is("beyond") ? filter.size - 2 : kPositionColumn, 3);
    if (is("overlap")) factor.columns.add(kPositionColumn + 2, 3);
    if (is("held")) factor.columns.add(filter.block(camera_).column(), 6);
    const int height = factor.columns.add(filter.block(ground_).column(), 1);
    factor.set_rows(2);
    // As plugins write that are built without Eigen's checks.
    if (is("more_rows")) factor.residual.data()[2] = 0.;
    if (is("more_columns")) factor.H.data()[2 * factor.columns.size()] = 0.;
    factor.H(0, 2) = is("wrong_sign") ? -1. : 1.;
    factor.H(1, 1) = 1e-3;
    factor.H(0, height) = is("no_derivative") ? 0. : 1.;
    factor.residual[0] = 0.1 - filter.imu.p_IinG.z() - filter.block(ground_).numbers()[0];
    if (is("nan")) factor.residual[1] = std::nan("");
    factor.R = 1e-2 * Eigen::Matrix2d::Identity() + sigma_m_ * Eigen::Matrix2d::Identity();
    if (is("asymmetric")) factor.R(0, 1) = 1e-3;
    if (is("negative")) factor.R(1, 1) = -0.5;
    if (is("shared")) factor.residual[0] += 1e-6 * shared_calls;
  }

  /// The host has dropped the factor of a block that has no variance.
  static bool exists(const FilterView& filter, BlockId id) {
    const int column = filter.block(id).column();
    return filter.P()(column, column) > 0.;
  }

  static void rewrite(const FilterView& filter, BlockId id, BlockEdits& edits) {
    const BlockView& block = filter.block(id);
    BlockRewrite same;
    same.id = id;
    same.columns.add(block.column(), block.size());
    same.J.setIdentity(block.size(), block.size());
    same.value[0] = same.first_estimate[0] = block.numbers()[0];
    edits.rewrite(same);
  }

  double sigma_m_;
  Declarations* host_ = nullptr;
  BlockId ground_, camera_;
  RoomId marks_;
  StreamId poses_;
  std::optional<BlockId> added_, last_;
};

VIWO_REGISTER(Update, Broken, kPluginName, "1.0.0", "an update with one mistake", "Apache-2.0",
              Params);

}  // namespace
}  // namespace viwo
