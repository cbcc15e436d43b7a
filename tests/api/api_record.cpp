// Prints what a plugin that was compiled against viwo/api relies on: sizes, alignments, offsets,
// types of members, values of enumerators, order of virtual functions. Compiled without flags for
// the processor, so that it prints the same everywhere (64 bit, Itanium C++ ABI).
#include <bit>
#include <cstddef>
#include <cstdint>
#include <iostream>
#include <string>
#include <string_view>
#include <typeinfo>
#include <utility>

#include <cxxabi.h>

#include "viwo/api/plugin.hpp"

namespace {

using namespace viwo;

std::string type_name(const std::type_info& type) {
  int status = 0;
  char* const text = abi::__cxa_demangle(type.name(), nullptr, nullptr, &status);
  std::string name = status == 0 ? text : type.name();
  std::free(text);
  const std::string_view string =
      "std::__cxx11::basic_string<char, std::char_traits<char>, "
      "std::allocator<char> >";
  for (std::size_t at; (at = name.find(string)) != std::string::npos;) {
    name.replace(at, string.size(), "std::string");
  }
  return name;
}

// How many members an aggregate has: as many as it can be initialised with.
struct Anything {
  template <class T>
  operator T() const;  // never defined
};
template <class T, std::size_t... I>
constexpr bool takes(std::index_sequence<I...> /*counted*/) {
  return requires { T{(static_cast<void>(I), Anything{})...}; };
}
template <class T, std::size_t kCount = 40>
constexpr std::size_t member_count() {
  if constexpr (kCount == 0 || takes<T>(std::make_index_sequence<kCount>())) {
    return kCount;
  } else {
    return member_count<T, kCount - 1>();
  }
}

template <class T>
void print_size(const char* name) {
  std::cout << "\n" << name << "  size " << sizeof(T) << ", align " << alignof(T);
  if constexpr (std::is_aggregate_v<T>) std::cout << ", members " << member_count<T>();
  std::cout << "\n";
}

#define RECORD(T) print_size<T>(#T)
#define MEMBER(T, m)                                                                        \
  std::cout << "  " << #m << "  at " << offsetof(T, m) << ", size " << sizeof(T::m) << ", " \
            << type_name(typeid(decltype(T::m))) << "\n"

template <auto kValue>
constexpr std::string_view enumerator() {
  std::string_view text = __PRETTY_FUNCTION__;
  const std::string_view key = "kValue = ";
  text.remove_prefix(text.find(key) + key.size());
  return text.substr(0, text.find_first_of(";]"));
}
template <class E, int kValue = 0>
void print_enumerators() {
  if constexpr (kValue < 16) {
    constexpr std::string_view name = enumerator<static_cast<E>(kValue)>();
    if (name.front() != '(') {
      std::cout << "  " << name.substr(name.rfind(':') + 1) << " = " << kValue << "\n";
    }
    print_enumerators<E, kValue + 1>();
  }
}
#define ENUM(E)      \
  print_size<E>(#E); \
  print_enumerators<E>()

/// Place of a virtual function in the table. Its address is coded in the pointer to member: as
/// 1 + offset, or, where code may have odd addresses, in the adjustment.
template <class F>
std::size_t slot(F function) {
  struct Words {
    std::uintptr_t address, adjustment;
  };
  const Words words = std::bit_cast<Words>(function);
  const std::uintptr_t offset = (words.address & 1) != 0 ? words.address - 1 : words.address;
  return offset / sizeof(void*);
}
#define VIRTUAL(T, f) \
  std::cout << "  " << #f << "  slot " << slot(&T::f) << ", " << type_name(typeid(&T::f)) << "\n"

/// Adds a virtual function: it comes behind all that the interface has.
template <class T>
struct WithOneMore : T {
  virtual void one_more() {}
};
#define SLOTS(T) \
  std::cout << "  slots " << slot(&WithOneMore<T>::one_more) << " (two of the destructor)\n"

#define CONSTANT(c) std::cout << #c << " = " << (c) << "\n"

void constants() {
  CONSTANT(kApiVersion);
  CONSTANT(kMaxDrives);
  CONSTANT(kMaxSteers);
  CONSTANT(kMaxRows);
  CONSTANT(kMaxIntrinsics);
  CONSTANT(kMaxNoises);
  CONSTANT(kMaxFactorRows);
  CONSTANT(kMaxFactorColumns);
  CONSTANT(kMaxFactorBlocks);
  CONSTANT(kThetaColumn);
  CONSTANT(kPositionColumn);
  CONSTANT(kVelocityColumn);
  CONSTANT(kGyroBiasColumn);
  CONSTANT(kAccelBiasColumn);
  CONSTANT(kImuSize);
  CONSTANT(kPoseSize);
}

void measurements() {
  RECORD(EncoderSample);
  MEMBER(EncoderSample, t_ns);
  MEMBER(EncoderSample, begin_ns);
  MEMBER(EncoderSample, end_ns);
  MEMBER(EncoderSample, n_drive);
  MEMBER(EncoderSample, n_steer);
  MEMBER(EncoderSample, drive_rad_per_s);
  MEMBER(EncoderSample, steer_rad);
  RECORD(ImuSample);
  MEMBER(ImuSample, t_ns);
  MEMBER(ImuSample, gyro_rad_per_s);
  MEMBER(ImuSample, accel_m_per_s2);
  RECORD(FeaturePoint);
  MEMBER(FeaturePoint, id);
  MEMBER(FeaturePoint, u_px);
  MEMBER(FeaturePoint, v_px);
  RECORD(FeatureSample);
  MEMBER(FeatureSample, t_ns);
  MEMBER(FeatureSample, camera);
  MEMBER(FeatureSample, points);
  RECORD(PoseSample);
  MEMBER(PoseSample, t_ns);
  MEMBER(PoseSample, p_BinW_m);
  MEMBER(PoseSample, q_BtoW_xyzw);
  RECORD(StateSample);
  MEMBER(StateSample, t_ns);
  MEMBER(StateSample, q_ItoG_xyzw);
  MEMBER(StateSample, p_IinG_m);
  MEMBER(StateSample, v_IinG_m_per_s);
  MEMBER(StateSample, gyro_bias_rad_per_s);
  MEMBER(StateSample, accel_bias_m_per_s2);
  RECORD(CalibrationSample);
  MEMBER(CalibrationSample, t_ns);
  MEMBER(CalibrationSample, name);
  MEMBER(CalibrationSample, value);
  RECORD(Image);
  MEMBER(Image, width_px);
  MEMBER(Image, height_px);
  MEMBER(Image, pixels);
  RECORD(ImageSource);
  SLOTS(ImageSource);
  VIRTUAL(ImageSource, read);
  RECORD(ImageSample);
  MEMBER(ImageSample, t_ns);
  MEMBER(ImageSample, camera);
  MEMBER(ImageSample, source);
  RECORD(Measurement);
  std::cout << "  is " << type_name(typeid(Measurement)) << "\n";
}

void descriptor() {
  ENUM(ParamType);
  RECORD(ParamSpec);
  MEMBER(ParamSpec, name);
  MEMBER(ParamSpec, type);
  MEMBER(ParamSpec, unit);
  MEMBER(ParamSpec, fallback);
  MEMBER(ParamSpec, min);
  MEMBER(ParamSpec, max);
  MEMBER(ParamSpec, min_exclusive);
  MEMBER(ParamSpec, choices);
  MEMBER(ParamSpec, help);
  RECORD(ParamSet);
  std::cout << "  value is " << type_name(typeid(ParamSet::Value)) << "\n";
  ENUM(LogLevel);
  RECORD(HostServices);
  MEMBER(HostServices, host);
  MEMBER(HostServices, log_text);
  MEMBER(HostServices, seed);
  ENUM(ErrorText::Cause);
  RECORD(ErrorText);
  MEMBER(ErrorText, cause);
  MEMBER(ErrorText, key);
  MEMBER(ErrorText, text);
  RECORD(PluginDescriptor);
  MEMBER(PluginDescriptor, struct_size);
  MEMBER(PluginDescriptor, api_version);
  MEMBER(PluginDescriptor, build_record);
  MEMBER(PluginDescriptor, kind);
  MEMBER(PluginDescriptor, name);
  MEMBER(PluginDescriptor, version);
  MEMBER(PluginDescriptor, summary);
  MEMBER(PluginDescriptor, license);
  MEMBER(PluginDescriptor, params);
  MEMBER(PluginDescriptor, n_params);
  MEMBER(PluginDescriptor, create);
  MEMBER(PluginDescriptor, destroy);
  ENUM(Status);
  RECORD(InputError);
  RECORD(ParamError);
}

void kinematics() {
  RECORD(RowMatrix);
  RECORD(RowVector);
  RECORD(RowJacobian);
  RECORD(TwistRowsJacobian);
  RECORD(Intrinsics);
  RECORD(NoiseVector);
  RECORD(RowRange);
  MEMBER(RowRange, first);
  MEMBER(RowRange, count);
  RECORD(IntrinsicSpec);
  MEMBER(IntrinsicSpec, name);
  MEMBER(IntrinsicSpec, unit);
  MEMBER(IntrinsicSpec, nominal);
  MEMBER(IntrinsicSpec, prior_sigma);
  MEMBER(IntrinsicSpec, gauge_fixed);
  MEMBER(IntrinsicSpec, rows);
  ENUM(NoiseKind);
  RECORD(NoiseSpec);
  MEMBER(NoiseSpec, kind);
  MEMBER(NoiseSpec, channel);
  MEMBER(NoiseSpec, sigma);
  MEMBER(NoiseSpec, rows);
  RECORD(ModelDescription);
  MEMBER(ModelDescription, n_drive);
  MEMBER(ModelDescription, n_steer);
  MEMBER(ModelDescription, n_rows);
  MEMBER(ModelDescription, constant_A);
  MEMBER(ModelDescription, noise_block);
  MEMBER(ModelDescription, intrinsics);
  MEMBER(ModelDescription, noises);
  RECORD(RowSystem);
  MEMBER(RowSystem, A);
  MEMBER(RowSystem, b);
  MEMBER(RowSystem, kept);
  RECORD(IntrinsicDerivatives);
  MEMBER(IntrinsicDerivatives, J);
  MEMBER(IntrinsicDerivatives, DtE);
  RECORD(NoiseDerivatives);
  MEMBER(NoiseDerivatives, J);
  MEMBER(NoiseDerivatives, DtE);
  RECORD(KinematicModel);
  SLOTS(KinematicModel);
  VIRTUAL(KinematicModel, describe);
  VIRTUAL(KinematicModel, rows);
  VIRTUAL(KinematicModel, intrinsic_derivatives);
  VIRTUAL(KinematicModel, noise_derivatives);
  VIRTUAL(KinematicModel, inverse);
  VIRTUAL(KinematicModel, move_frame);
}

void filter_view() {
  RECORD(ImuView);
  MEMBER(ImuView, R_GtoI);
  MEMBER(ImuView, p_IinG);
  MEMBER(ImuView, v_IinG);
  MEMBER(ImuView, gyro_bias);
  MEMBER(ImuView, accel_bias);
  MEMBER(ImuView, R_GtoI_fej);
  MEMBER(ImuView, p_IinG_fej);
  MEMBER(ImuView, v_IinG_fej);
  RECORD(CloneView);
  MEMBER(CloneView, t_ns);
  MEMBER(CloneView, slot);
  MEMBER(CloneView, column);
  MEMBER(CloneView, R_GtoI);
  MEMBER(CloneView, p_IinG);
  MEMBER(CloneView, R_GtoI_fej);
  MEMBER(CloneView, p_IinG_fej);
  MEMBER(CloneView, w_IinI);
  MEMBER(CloneView, v_IinG);
  ENUM(CameraDistortion);
  RECORD(CameraView);
  MEMBER(CameraView, distortion);
  MEMBER(CameraView, width_px);
  MEMBER(CameraView, height_px);
  MEMBER(CameraView, intrinsics);
  MEMBER(CameraView, R_ItoC);
  MEMBER(CameraView, p_IinC);
  MEMBER(CameraView, t_CtoI_s);
  MEMBER(CameraView, extrinsics_column);
  MEMBER(CameraView, intrinsics_column);
  RECORD(WheelsView);
  MEMBER(WheelsView, model);
  MEMBER(WheelsView, R_ItoO);
  MEMBER(WheelsView, p_IinO);
  MEMBER(WheelsView, t_OtoI_s);
  MEMBER(WheelsView, x_WI);
  MEMBER(WheelsView, extrinsics_column);
  MEMBER(WheelsView, time_offset_column);
  MEMBER(WheelsView, intrinsics_column);
  RECORD(ImuNoise);
  MEMBER(ImuNoise, gyro_rad_per_s_sqrt_hz);
  MEMBER(ImuNoise, accel_m_per_s2_sqrt_hz);
  MEMBER(ImuNoise, gyro_walk_rad_per_s2_sqrt_hz);
  MEMBER(ImuNoise, accel_walk_m_per_s3_sqrt_hz);
  RECORD(FilterView);
  MEMBER(FilterView, imu);
  MEMBER(FilterView, clones);
  MEMBER(FilterView, cameras);
  MEMBER(FilterView, wheels);
  MEMBER(FilterView, imu_noise);
  MEMBER(FilterView, gravity_m_per_s2);
  MEMBER(FilterView, oldest_leaves);
  MEMBER(FilterView, size);
  MEMBER(FilterView, covariance_data);
  MEMBER(FilterView, covariance_stride);
  RECORD(EpochData);
  MEMBER(EpochData, begin_ns);
  MEMBER(EpochData, end_ns);
  MEMBER(EpochData, features);
  MEMBER(EpochData, imu);
  MEMBER(EpochData, encoders);
  MEMBER(EpochData, poses);
}

void sensors_and_updates() {
  RECORD(RejectionCount);
  MEMBER(RejectionCount, reason);
  MEMBER(RejectionCount, count);
  MEMBER(RejectionCount, first);
  RECORD(EstimateSample);
  MEMBER(EstimateSample, t_ns);
  MEMBER(EstimateSample, q_ItoG_xyzw);
  MEMBER(EstimateSample, p_IinG_m);
  MEMBER(EstimateSample, v_IinG_m_per_s);
  MEMBER(EstimateSample, w_IinI_rad_per_s);
  MEMBER(EstimateSample, covariance);
  MEMBER(EstimateSample, latency_s);
  MEMBER(EstimateSample, calibration_names);
  MEMBER(EstimateSample, calibration);
  MEMBER(EstimateSample, calibration_sigma);
  RECORD(Sensor);
  SLOTS(Sensor);
  VIRTUAL(Sensor, next);
  VIRTUAL(Sensor, rejections);
  VIRTUAL(Sensor, takes_input);
  VIRTUAL(Sensor, connect);
  VIRTUAL(Sensor, live);
  VIRTUAL(Sensor, stop);
  VIRTUAL(Sensor, estimate);
  RECORD(ColumnRange);
  MEMBER(ColumnRange, first);
  MEMBER(ColumnRange, count);
  RECORD(FactorColumns);
  RECORD(ResidualFactor);
  MEMBER(ResidualFactor, columns);
  MEMBER(ResidualFactor, H);
  MEMBER(ResidualFactor, residual);
  MEMBER(ResidualFactor, R);
  MEMBER(ResidualFactor, gate_probability);
  RECORD(InformationFactor);
  MEMBER(InformationFactor, columns);
  MEMBER(InformationFactor, Lambda);
  MEMBER(InformationFactor, eta);
  RECORD(FactorSink);
  RECORD(UpdateSetup);
  MEMBER(UpdateSetup, max_clones);
  MEMBER(UpdateSetup, max_state_size);
  MEMBER(UpdateSetup, cameras);
  MEMBER(UpdateSetup, wheels);
  ENUM(UpdateKind);
  RECORD(Update);
  SLOTS(Update);
  VIRTUAL(Update, kind);
  VIRTUAL(Update, start);
  VIRTUAL(Update, update);
  VIRTUAL(Update, rejections);
}

}  // namespace

int main() {
  constants();
  measurements();
  descriptor();
  kinematics();
  filter_view();
  sensors_and_updates();
}
