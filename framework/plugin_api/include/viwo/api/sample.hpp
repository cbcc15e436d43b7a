// Kinds of samples: what a sensor yields and an update takes. A kind is a plain struct with a stamp
// `t_ns`, a name and a version; viwo's own (measurement.hpp) are made as those of a plugin are:
//
//   struct RangeSample {
//     std::int64_t t_ns = 0;  ///< stamp in the clock of the sensor
//     int beacon = 0;
//     double range_m = 0.;
//   };
//   VIWO_SAMPLE(RangeSample, "range", 1, &RangeSample::t_ns, &RangeSample::beacon,
//               &RangeSample::range_m);
//
// The members may add what the host wants to know of a sample: `begin_ns` and `end_ns` (it stands
// for a cell of time, not for an instant), `channel` or `camera` (the sensor has several clocks,
// this one's index), `const char* fault() const` (what is wrong with its values, nullptr for
// nothing).
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>
#include <vector>

#include "viwo/api/export.hpp"

namespace viwo {

/// Specialised by VIWO_SAMPLE.
template <class T>
struct SampleTraits;

template <class T>
concept Sample = requires(const T& sample) {
  SampleTraits<T>::kName;
  { sample.t_ns } -> std::convertible_to<std::int64_t>;
};

class SampleBuffer;

/// The time that a sample stands for; begin = end = t for an instant.
struct SampleExtent {
  std::int64_t t_ns = 0;
  std::int64_t begin_ns = 0;
  std::int64_t end_ns = 0;
};

/// A kind of samples, as one library was compiled with it. Two libraries may exchange samples only
/// if all of what describes the kind agrees.
struct SampleType {
  const char* name;
  int version;
  std::uint64_t size;
  std::uint64_t align;
  std::uint64_t layout;  ///< digest of where the members lie
  SampleExtent (*extent)(const void* sample);
  int (*channel)(const void* sample);        ///< which clock of the sensor
  const char* (*fault)(const void* sample);  ///< nullptr: the values can be used
  std::unique_ptr<SampleBuffer> (*make_buffer)();

  bool has_name_of(const SampleType& other) const { return std::strcmp(name, other.name) == 0; }
  /// The same kind, in the same layout.
  bool operator==(const SampleType& other) const {
    return this == &other || (version == other.version && size == other.size &&
                              align == other.align && layout == other.layout && has_name_of(other));
  }
};

template <Sample T>
const SampleType& sample_type();

/// Kinds of samples in a list: sample_types<ImuSample, FeatureSample>().
using SampleTypes = std::vector<const SampleType*>;
template <Sample... T>
SampleTypes sample_types() {
  return {&sample_type<T>()...};
}

/// A sample of any kind, somewhere in memory; valid as long as that is.
class SampleView {
 public:
  SampleView(const SampleType& type, const void* data) : type_(&type), data_(data) {}
  template <Sample T>
  SampleView(const T& sample)  // NOLINT: a sample is a view of itself
      : SampleView(sample_type<T>(), &sample) {}

  const SampleType& type() const { return *type_; }
  const void* data() const { return data_; }
  SampleExtent extent() const { return type_->extent(data_); }
  std::int64_t t_ns() const { return extent().t_ns; }
  /// nullptr when it is of another kind.
  template <Sample T>
  const T* get_if() const {
    return *type_ == sample_type<T>() ? static_cast<const T*>(data_) : nullptr;
  }

 private:
  const SampleType* type_;
  const void* data_;
};

/// Samples of one kind, side by side in memory. The storage of those that were dropped is used
/// again: nothing is allocated in the steady state.
class VIWO_API SampleBuffer {
 public:
  virtual ~SampleBuffer();
  virtual const SampleType& type() const = 0;
  /// A copy of a sample of that kind behind the others.
  virtual void push(const void* sample) = 0;
  virtual void drop_front(std::size_t count) = 0;
  virtual const void* at(std::size_t i) const = 0;
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  SampleView view(std::size_t i) const { return {type(), at(i)}; }
  SampleExtent extent(std::size_t i) const { return type().extent(at(i)); }

 protected:
  std::size_t size_ = 0;
};

template <Sample T>
class TypedBuffer final : public SampleBuffer {
 public:
  TypedBuffer() { slots_.reserve(1024); }
  const SampleType& type() const override { return sample_type<T>(); }
  void push(const void* sample) override { push(*static_cast<const T*>(sample)); }
  void push(const T& sample) {
    if (first_ + size_ == slots_.size()) {
      // Moving what is left is worth while when it is less than what has gone.
      if (first_ > size_) {
        std::rotate(slots_.begin(), slots_.begin() + static_cast<std::ptrdiff_t>(first_),
                    slots_.end());
        first_ = 0;
      } else {
        slots_.emplace_back();
      }
    }
    slots_[first_ + size_++] = sample;
  }
  void drop_front(std::size_t count) override {
    count = std::min(count, size_);
    size_ -= count;
    first_ = size_ == 0 ? 0 : first_ + count;
  }
  const void* at(std::size_t i) const override { return &slots_[first_ + i]; }
  std::span<const T> samples() const { return {slots_.data() + first_, size_}; }

 private:
  std::vector<T> slots_;
  std::size_t first_ = 0;
};

/// One timestamped datum of any sensor: a sample of any kind. It cannot be changed any more, and
/// copies share it.
class Measurement {
 public:
  Measurement() = default;
  template <Sample T>
  Measurement(T sample)  // NOLINT: a sample is a measurement
      : type_(&sample_type<T>()), data_(std::make_shared<const T>(std::move(sample))) {}

  bool empty() const { return data_ == nullptr; }
  /// Of a measurement that is not empty.
  SampleView view() const { return {*type_, data_.get()}; }
  std::int64_t t_ns() const { return view().t_ns(); }
  /// nullptr when it is empty or of another kind.
  template <Sample T>
  const T* get_if() const {
    return data_ != nullptr ? view().get_if<T>() : nullptr;
  }

 private:
  const SampleType* type_ = nullptr;
  std::shared_ptr<const void> data_;
};

inline std::int64_t stamp_ns(const Measurement& measurement) { return measurement.t_ns(); }

/// Calls `f` with the sample if it is of one of these kinds; false when it is of none.
template <Sample... Kinds, class F>
bool visit_one_of(const Measurement& measurement, F&& f) {
  const auto visit = [&f](const auto* sample) {
    if (sample != nullptr) f(*sample);
    return sample != nullptr;
  };
  return (visit(measurement.get_if<Kinds>()) || ...);
}

namespace detail {

template <class T, class... Member>
std::uint64_t layout_of(Member T::*... member) {
  static const T kSample{};
  std::uint64_t digest = 14695981039346656037ull;  // FNV-1a
  const auto add = [&digest](std::uint64_t value) { digest = (digest ^ value) * 1099511628211ull; };
  const auto offset = [](const auto& value) {
    return static_cast<std::uint64_t>(reinterpret_cast<const char*>(&value) -
                                      reinterpret_cast<const char*>(&kSample));
  };
  ((add(offset(kSample.*member)), add(sizeof(kSample.*member)),
    add(std::is_floating_point_v<Member>)),
   ...);
  return digest;
}

template <class T>
SampleExtent extent_of(const void* data) {
  const T& sample = *static_cast<const T*>(data);
  if constexpr (requires {
                  sample.begin_ns;
                  sample.end_ns;
                }) {
    return {sample.t_ns, sample.begin_ns, sample.end_ns};
  } else {
    return {sample.t_ns, sample.t_ns, sample.t_ns};
  }
}

template <class T>
int channel_of([[maybe_unused]] const void* data) {
  if constexpr (requires(const T& sample) { sample.channel; }) {
    return static_cast<const T*>(data)->channel;
  } else if constexpr (requires(const T& sample) { sample.camera; }) {
    return static_cast<const T*>(data)->camera;
  } else {
    return 0;
  }
}

template <class T>
const char* fault_of([[maybe_unused]] const void* data) {
  if constexpr (requires(const T& sample) { sample.fault(); }) {
    return static_cast<const T*>(data)->fault();
  } else {
    return nullptr;
  }
}

template <class T>
std::unique_ptr<SampleBuffer> make_buffer_of() {
  return std::make_unique<TypedBuffer<T>>();
}

}  // namespace detail

template <Sample T>
const SampleType& sample_type() {
  static const SampleType kType{SampleTraits<T>::kName,
                                SampleTraits<T>::kVersion,
                                sizeof(T),
                                alignof(T),
                                SampleTraits<T>::layout(),
                                &detail::extent_of<T>,
                                &detail::channel_of<T>,
                                &detail::fault_of<T>,
                                &detail::make_buffer_of<T>};
  return kType;
}

}  // namespace viwo

/// Makes a struct a kind of samples: its name, its version (to be bumped with any change of layout
/// or meaning), then pointers to its members. In no namespace.
#define VIWO_SAMPLE(Type, sample_name, sample_version, ...)                                \
  template <>                                                                              \
  struct viwo::SampleTraits<Type> {                                                        \
    static constexpr const char* kName = sample_name;                                      \
    static constexpr int kVersion = sample_version;                                        \
    static std::uint64_t layout() { return ::viwo::detail::layout_of<Type>(__VA_ARGS__); } \
  }
