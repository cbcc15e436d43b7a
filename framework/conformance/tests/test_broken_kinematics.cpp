// Each mistake of a kinematic model fails, with a message that names it.
#include <csignal>

#include <pthread.h>

#include "support.hpp"

namespace viwo::conformance {
namespace {

std::string failures(const std::string& defect) { return failures_of("kinematics", defect); }

TEST(BrokenKinematics, WithoutAMistakeItPasses) { EXPECT_EQ(failures("none"), ""); }

TEST(BrokenKinematics, AWrongSignInOneColumn) {
  EXPECT_EQ(failures("sign"),
            "derivatives by the intrinsics: column baseline of d(b - A xi)/d x_WI: analytic "
            "0.4, numeric -0.4 (row 1) at spin");
}

TEST(BrokenKinematics, AWrongSignInTheDerivativeOfA) {
  EXPECT_EQ(failures("dte"),
            "derivatives by the intrinsics: column baseline of (dA/d x_WI)^T e: analytic "
            "-0.28844, numeric -0.63457 (entry omega) at rest");
}

TEST(BrokenKinematics, AFactorInANoiseColumn) {
  EXPECT_EQ(failures("noise_scale"),
            "derivatives by the noise: column noise source 1 (drive 1) of d(b - A xi)/d n: "
            "analytic 0.0505, numeric 0.05 (row 1) at rest");
}

TEST(BrokenKinematics, ASlipSourceThatEntersNothing) {
  EXPECT_EQ(failures("no_slip"),
            "noise model: the noise of row 2 is singular at rest: no source enters some "
            "direction of them - add a slip source\nderivatives by the noise: column noise "
            "source 2 (slip 0) of d(b - A xi)/d n is zero at rest - it is the velocity that "
            "unit slip adds to b");
}

TEST(BrokenKinematics, TheMeasuredSignalWhereTheFittedOneIsAskedFor) {
  EXPECT_EQ(failures("measured"),
            "derivatives at the fitted signal: column r_left of d(b - A xi)/d x_WI at the "
            "fitted signal: analytic 0.000117532, numeric 0 (row 0) at rest with a reading "
            "that is off by 0.001 - differentiate at the signal `b` that is given, not at "
            "rows.b");
}

TEST(BrokenKinematics, ARowRangeThatIsTooSmall) {
  EXPECT_EQ(failures("row_range"),
            "row ranges: rows of 'baseline' are declared as [0, 1), but row 1 depends on it "
            "(-0.4) at spin - declare all rows that it touches in describe()");
}

TEST(BrokenKinematics, AnAThatIsNotConstant) {
  EXPECT_EQ(failures("constant_A"),
            "constant A: constant_A is set, but A at straight differs by up to 0.01 from that "
            "at another sample - do not set it\nderivatives by the noise: column noise source "
            "0 (drive 0) of (dA/d n)^T e: analytic 0, numeric -0.000549423 (entry v_x) at "
            "rest\nrow ranges: rows of noise source 0 (drive 0) are declared as [0, 1), but "
            "row 2 depends on it (-0.0005) at straight - declare all rows that it touches in "
            "describe()");
}

TEST(BrokenKinematics, BothWheelsOnOneSide) {
  EXPECT_EQ(failures("rank"),
            "rank of A: A has rank 2 at all readings tried: v_x and omega cannot be told apart - "
            "check the signs of A; a direction that no wheel measures needs a row with a slip "
            "source (v_y = 0)");
}

TEST(BrokenKinematics, AGaugeEntryThatIsNotGauge) {
  EXPECT_EQ(failures("gauge"),
            "gauge: entry 'r_left' is not gauge: motion shows it (rank 6 falls to 5 when it is "
            "held), so holding a wrong value would spoil the others - do not set gauge_fixed");
}

TEST(BrokenKinematics, AFrameThatMovesWrong) {
  EXPECT_EQ(failures("move_frame"),
            "gauge: move_frame() moves O in 3 ways, but the gauge entries (none) hold only 0 "
            "of them - hold what places O on the body, or let move_frame() answer "
            "kUnsupported\nchange of frame: after a change of frame the same reading does not "
            "fit the same motion: b - A xi is 0.179574 m/s - move_frame() takes [yaw, x, y] of "
            "the new O in the old one");
}

TEST(BrokenKinematics, AnInverseThatTurnsTheOtherWay) {
  EXPECT_EQ(failures("inverse"),
            "inverse kinematics: the reading of inverse() does not fit at spin: row 0 of b - A "
            "xi is 0.24 m/s");
}

TEST(BrokenKinematics, StateThatInstancesShare) {
  EXPECT_EQ(failures("shared"),
            "independent instances: an instance changes when another one is made with a "
            "different 'radius_m' - no static variables: instances must not see each other");
}

TEST(BrokenKinematics, ParametersOfTheFirstInstance) {
  EXPECT_EQ(failures("first_instance"),
            "independent instances: no parameter changes what the model says - are they read, "
            "and not kept from the first instance?");
}

TEST(BrokenKinematics, NumbersThatChange) {
  EXPECT_EQ(failures("random"),
            "repeatable: the same call gives other numbers the second time, at rest - results "
            "may depend on the arguments alone");
}

TEST(BrokenKinematics, ACacheInTheObject) {
  EXPECT_EQ(failures("cache"),
            "repeatable: derivatives at rest change when rows() of another sample (straight) "
            "is called before - keep what they need in RowSystem::kept, not in the object");
}

TEST(BrokenKinematics, AnOutputThatIsOnlyAddedTo) {
  EXPECT_EQ(failures("adds"),
            "repeatable: outputs that hold the numbers of another sample come out different at "
            "straight - write every entry that is not always zero, and set before you add");
}

TEST(BrokenKinematics, ACrashOnNan) {
  EXPECT_EQ(failures("crash"),
            "hostile readings: crashed: Segmentation fault - run it under a debugger, or build "
            "plugin and host with VIWO_SANITIZE=address,undefined");
}

TEST(BrokenKinematics, AnExceptionOnNan) {
  EXPECT_EQ(failures("throws"),
            "hostile readings: drive 0 reads NaN: threw 'not a number' - answer "
            "Status::kRejected");
}

TEST(BrokenKinematics, ACallThatDoesNotReturn) {
  Options options;
  options.time_limit_s = 2;
  EXPECT_EQ(failures_of("kinematics", "endless", options),
            "hostile readings: took longer than 2 s: a call of the plugin does not return");
}

/// As a shell may leave it to the programs that it starts.
TEST(BrokenKinematics, ACallThatDoesNotReturnWhereAlarmsAreIgnored) {
  Options options;
  options.time_limit_s = 2;
  sigset_t alarm, mask;
  sigemptyset(&alarm);
  sigaddset(&alarm, SIGALRM);
  const auto handler = std::signal(SIGALRM, SIG_IGN);
  pthread_sigmask(SIG_BLOCK, &alarm, &mask);
  EXPECT_EQ(failures_of("kinematics", "endless", options),
            "hostile readings: took longer than 2 s: a call of the plugin does not return");
  pthread_sigmask(SIG_SETMASK, &mask, nullptr);
  std::signal(SIGALRM, handler);
}

TEST(BrokenKinematics, ANegativeNoise) {
  EXPECT_EQ(failures("noise"),
            "noise model: noise source 1 (drive 1): sigma -0.001 is not positive");
}

TEST(BrokenKinematics, ANoiseOfNoChannel) {
  EXPECT_EQ(failures("channel"),
            "noise model: noise source 1 (drive 2): there is no such channel, the model has 2");
}

TEST(BrokenKinematics, ARowWithoutNoise) {
  EXPECT_EQ(failures("rows_without_noise"),
            "noise model: the noise of row 2 is singular at rest: no source enters some "
            "direction of them - add a slip source");
}

TEST(BrokenKinematics, APriorOfZero) {
  EXPECT_EQ(failures("prior"), "description: intrinsic 'baseline': prior sigma 0 is not positive");
}

TEST(BrokenKinematics, AnIntrinsicWithoutUnit) {
  EXPECT_EQ(failures("no_unit"),
            "description: intrinsic 'r_right' has no unit - say \"1\" for a pure number");
}

TEST(BrokenKinematics, AParameterWithoutHelp) {
  EXPECT_EQ(failures("no_help"),
            "schema: parameter 'radius_m' has no help - say in one sentence what it does");
}

TEST(BrokenKinematics, AParameterWithoutTheUnitInItsName) {
  EXPECT_EQ(failures("name_without_unit"),
            "schema: parameter 'radius' is in m, but its name does not say so - end it in '_m'");
}

TEST(BrokenKinematics, AConstructorThatThrowsWithinTheBounds) {
  EXPECT_EQ(failures("throws_at_the_edge"),
            "parameters: parameter 'baseline_m' at its limit 1e-09: the constructor threw 'too "
            "narrow' - throw ParamError(\"parameter\", \"what is wrong\") for values that do "
            "not work");
}

}  // namespace
}  // namespace viwo::conformance
