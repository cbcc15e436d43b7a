// How api_record.cpp prints sizes, alignments, offsets, types of members, values of enumerators and
// the order of virtual functions.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <iostream>
#include <string>
#include <string_view>
#include <typeinfo>
#include <utility>

#include <cxxabi.h>

#include "viwo/api/sample.hpp"

namespace viwo {

inline std::string type_name(const std::type_info& type) {
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
template <class F>
void print_virtual(const char* name, F function) {
  std::cout << "  " << name << "  slot " << slot(function) << ", " << type_name(typeid(F)) << "\n";
}
#define VIRTUAL(T, f) print_virtual(#f, &T::f)
/// One of several functions of that name.
#define VIRTUAL_OF(T, f, Type) print_virtual<Type>(#f, &T::f)

/// Adds a virtual function: it comes behind all that the interface has.
template <class T>
struct WithOneMore : T {
  virtual void one_more() {}
};
#define SLOTS(T) \
  std::cout << "  slots " << slot(&WithOneMore<T>::one_more) << " (two of the destructor)\n"

/// A kind of samples: what two libraries compare before they exchange any.
#define SAMPLE(T)                                                                               \
  std::cout << "  kind '" << sample_type<T>().name << "', version " << sample_type<T>().version \
            << ", layout " << sample_type<T>().layout << "\n"

#define CONSTANT(c) std::cout << #c << " = " << (c) << "\n"

}  // namespace viwo
