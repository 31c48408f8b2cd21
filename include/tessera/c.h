/// The C interface: for C, and for whatever calls C through a foreign function interface. @file
///
/// Everything is made from the registry of operations: what `tessera --help` explains is found here under the
/// same names. What holds for every function:
///
/// Errors are values. A function that can fail returns a tessera_status, TESSERA_OK being 0, and, where
/// `error` is not NULL, leaves there a tessera_error that says what was wrong with what, which the caller
/// frees; on success that is NULL. Results behind pointers are NULL after a failure. No C++ exception leaves
/// a function; NULL, unknown values and handles of another kind are answered with TESSERA_USAGE.
///
/// Handles (tessera_image, tessera_parameters, tessera_context, tessera_prepared, tessera_error) are the
/// caller's, who gives each back once, to its function with _free in the name, which accepts NULL. Images and
/// prepared graphs keep whatever they are made from alive.
///
/// Threads: every function may be called from any thread at any time. An image is immutable and may be used
/// by many threads, and so may a context and a prepared graph; a tessera_parameters must not be changed while
/// another thread uses it.
///
/// Text is UTF-8, ends with 0, and belongs to the library: that of the registry lives as long as the library
/// is loaded, that of a handle as long as the handle. File names are what the system's open takes.
///
/// Structures start with struct_size, which the caller sets to sizeof: the library reads and fills no more
/// than that. Later versions add members at the end; a member that is absent counts as 0. TESSERA_INIT gives
/// a structure with its size set and all else 0, which is every member's default.
///
/// Versions: a program made with this header runs with every shared library of the same TESSERA_C_VERSION
/// that is as new as the header; tessera_c_version() tells that of the library.
#ifndef TESSERA_C_H_
#define TESSERA_C_H_

#include <stddef.h>
#include <stdint.h>

#include "tessera/export.h"

/// Of this interface: the number in the shared library's name, raised when something is taken away or
/// changed.
#define TESSERA_C_VERSION 1

/// A structure of that type with its size set and all else 0: tessera_pixels p =
/// TESSERA_INIT(tessera_pixels);
#define TESSERA_INIT(type) \
  { .struct_size = sizeof(type) }

#ifdef __cplusplus
extern "C" {
#endif

/// TESSERA_C_VERSION of the library that runs.
TESSERA_API uint32_t tessera_c_version(void);
/// The library's version, "0.1.0".
TESSERA_API const char* tessera_version(void);

/// How a call ended, and what kind of thing was wrong.
typedef int32_t tessera_status;
enum {
  TESSERA_OK = 0,     ///< all went well
  TESSERA_USAGE = 1,  ///< the call is wrong: NULL, a wrong handle, an unknown name, a value out of its range
  TESSERA_DATA = 2,  ///< an image or a file does not fit: missing, broken, of another size, without a channel
  TESSERA_SYSTEM = 3,     ///< memory or a file was refused by the system
  TESSERA_CANCELLED = 4,  ///< the progress callback said so
  TESSERA_INTERNAL = 5    ///< a fault of the library
};

/// What was wrong with what.
typedef struct tessera_error tessera_error;
/// The status that the function returned; TESSERA_OK for NULL.
TESSERA_API tessera_status tessera_error_status(const tessera_error* error);
/// The file, operation, parameter or argument; "" for NULL.
TESSERA_API const char* tessera_error_subject(const tessera_error* error);
/// What was found, and what was expected; "" for NULL.
TESSERA_API const char* tessera_error_reason(const tessera_error* error);
/// Frees it; NULL is fine.
TESSERA_API void tessera_error_free(tessera_error* error);

/// How a sample is stored. Integers are unsigned and normalised, half is IEEE binary16.
typedef int32_t tessera_type;
enum {
  TESSERA_TYPE_DEFAULT = 0,  ///< in options: the image's own
  TESSERA_UINT8 = 1,         ///< 0 to 255 stands for 0 to 1
  TESSERA_UINT16 = 2,        ///< 0 to 65535 stands for 0 to 1
  TESSERA_HALF = 3,          ///< 16-bit float
  TESSERA_FLOAT = 4          ///< 32-bit float
};

/// A rectangle of pixels, x right and y down: x0 <= x < x1 and y0 <= y < y1. All four 0: none is given.
typedef struct tessera_window {
  int32_t x0;  ///< first column
  int32_t y0;  ///< first row
  int32_t x1;  ///< behind the last column
  int32_t y1;  ///< behind the last row
} tessera_window;

/// The caller's pixels, of any type and strides (interleaved, planar, part of a larger picture, upside down).
typedef struct tessera_pixels {
  size_t struct_size;      ///< sizeof(tessera_pixels)
  void* data;              ///< first channel of the pixel at (window.x0, window.y0)
  tessera_window window;   ///< which pixels they are
  int32_t channels;        ///< 1 to 1024
  tessera_type type;       ///< of the samples; not the default
  int64_t channel_stride;  ///< bytes from channel to channel
  int64_t pixel_stride;    ///< bytes from pixel to pixel of a row
  int64_t row_stride;      ///< bytes from row to row; all three 0: interleaved without gaps
} tessera_pixels;

/// What an image is beside its pixels.
typedef struct tessera_image_options {
  size_t struct_size;             ///< sizeof(tessera_image_options)
  tessera_window display_window;  ///< none: the window of the pixels
  const char* channels;  ///< names, comma-separated: "R,G,B,A"; NULL: R,G,B,A then channel4 ...; Y; Y,A
  const char* alpha;     ///< name of the alpha channel; NULL: A where there is one; "": none
} tessera_image_options;

/// A lazy image: pixels, a file, or an operation on other images. Nothing is computed before it is rendered
/// or written. Immutable.
typedef struct tessera_image tessera_image;

/// An image of the caller's pixels, which are not copied: they must stay, unchanged, until `release` is
/// called, when this image and all that are made from it have been freed; or, without `release`, until then.
/// `options` may be NULL. `release` may be called from any thread and must not call the library. It is not
/// called after a failure.
TESSERA_API tessera_status tessera_image_borrow(const tessera_pixels* pixels,
                                                const tessera_image_options* options,
                                                void (*release)(void* user), void* user,
                                                tessera_image** image, tessera_error** error);
/// The same with a copy of the pixels.
TESSERA_API tessera_status tessera_image_copy(const tessera_pixels* pixels,
                                              const tessera_image_options* options, tessera_image** image,
                                              tessera_error** error);
/// Frees the handle; images made from it live on. NULL is fine.
TESSERA_API void tessera_image_free(tessera_image* image);

/// What an image is.
typedef struct tessera_image_info {
  size_t struct_size;             ///< sizeof(tessera_image_info), set by the caller
  tessera_window data_window;     ///< the pixels that exist
  tessera_window display_window;  ///< the frame that is shown
  int32_t channels;               ///< how many
  int32_t alpha;                  ///< index of the alpha channel, -1 for none
  tessera_type type;              ///< of a source, suggested for a result
} tessera_image_info;
/// Fills `info`. Costs nothing.
TESSERA_API tessera_status tessera_image_get_info(const tessera_image* image, tessera_image_info* info,
                                                  tessera_error** error);
/// The name of a channel; NULL where there is none of that index.
TESSERA_API const char* tessera_image_channel(const tessera_image* image, int32_t index);

/// An operation of the registry.
typedef struct tessera_operation tessera_operation;
/// How many there are.
TESSERA_API size_t tessera_operation_count(void);
/// The operation of that index, in the order of the help; NULL beyond the last.
TESSERA_API const tessera_operation* tessera_operation_at(size_t index);
/// The operation of that name ("saturate"); NULL for an unknown one.
TESSERA_API const tessera_operation* tessera_operation_find(const char* name);

/// What an operation is.
typedef struct tessera_operation_info {
  size_t struct_size;   ///< sizeof(tessera_operation_info), set by the caller
  const char* name;     ///< "saturate"
  const char* family;   ///< "color"
  const char* summary;  ///< one line
  const char* help;     ///< paragraphs: formula, channels, ranges, hard cases, source
  const char* bound;    ///< the error bound in words
  double bound_u;       ///< bound = bound_u * 2^-24 * the scale of the result
  int32_t generator;    ///< 1: made from nothing by tessera_generate
  int32_t images;       ///< how many it takes; -1: tessera_parameters_images tells
  size_t parameters;    ///< how many there are
  size_t examples;      ///< how many argument lines tessera_operation_example has
} tessera_operation_info;
/// Fills `info`.
TESSERA_API tessera_status tessera_operation_get_info(const tessera_operation* operation,
                                                      tessera_operation_info* info, tessera_error** error);
/// An argument line as tessera_parameters_parse reads it, the typical one first; NULL beyond the last.
TESSERA_API const char* tessera_operation_example(const tessera_operation* operation, size_t index);

/// What a parameter holds.
typedef int32_t tessera_parameter_kind;
enum {
  TESSERA_NUMBER = 0,   ///< one finite number: tessera_set_number
  TESSERA_INTEGER = 1,  ///< a whole number: tessera_set_integer
  TESSERA_FLAG = 2,     ///< 0 or 1: tessera_set_flag
  TESSERA_NUMBERS = 3,  ///< several: tessera_set_numbers
  TESSERA_CHOICE = 4,   ///< one of a few words: tessera_set_text
  TESSERA_TEXT = 5      ///< tessera_set_text
};

/// What a parameter may be.
typedef struct tessera_parameter_info {
  size_t struct_size;           ///< sizeof(tessera_parameter_info), set by the caller
  const char* name;             ///< "sigma"
  tessera_parameter_kind kind;  ///< which function sets it
  int32_t positional;           ///< 1: an argument of the command line rather than a modifier
  int32_t required;             ///< 1: has no default
  const char* default_value;    ///< as text; "" for none
  const char* help;             ///< one line, with the unit
  const char* use;              ///< "only with mode=linear": where it has a use; "" for everywhere
  double minimum;               ///< least number, -1e38 for any
  double maximum;               ///< largest number, 1e38 for any
  int32_t count_minimum;        ///< of TESSERA_NUMBERS
  int32_t count_maximum;        ///< of TESSERA_NUMBERS
  size_t counts;        ///< of TESSERA_NUMBERS: when not 0, only the counts of tessera_parameter_count
  size_t choices;       ///< of TESSERA_CHOICE: how many words tessera_parameter_choice has
  int32_t numbers_too;  ///< of TESSERA_CHOICE: 1: tessera_set_numbers is accepted as well
} tessera_parameter_info;
/// Fills `info` for the parameter of that index.
TESSERA_API tessera_status tessera_parameter_get_info(const tessera_operation* operation, size_t parameter,
                                                      tessera_parameter_info* info, tessera_error** error);
/// A word that the parameter may be; NULL beyond the last.
TESSERA_API const char* tessera_parameter_choice(const tessera_operation* operation, size_t parameter,
                                                 size_t index);
/// How many numbers the parameter may have; 0 beyond the last.
TESSERA_API int32_t tessera_parameter_count(const tessera_operation* operation, size_t parameter,
                                            size_t index);

/// Values for the parameters of one operation; those that are not set have their defaults.
typedef struct tessera_parameters tessera_parameters;
/// None set yet. `operation` is its name; an unknown one is answered with the nearest.
TESSERA_API tessera_status tessera_parameters_new(const char* operation, tessera_parameters** parameters,
                                                  tessera_error** error);
/// Frees it; NULL is fine.
TESSERA_API void tessera_parameters_free(tessera_parameters* parameters);
/// Sets a TESSERA_NUMBER, or TESSERA_NUMBERS to a single one. Names and kinds are checked by these functions;
/// ranges too, but what depends on other parameters only where they are used.
TESSERA_API tessera_status tessera_set_number(tessera_parameters* parameters, const char* name, double value,
                                              tessera_error** error);
/// Sets a TESSERA_INTEGER, or a TESSERA_NUMBER.
TESSERA_API tessera_status tessera_set_integer(tessera_parameters* parameters, const char* name,
                                               int64_t value, tessera_error** error);
/// Sets a TESSERA_FLAG to 0 or 1.
TESSERA_API tessera_status tessera_set_flag(tessera_parameters* parameters, const char* name, int32_t value,
                                            tessera_error** error);
/// Sets TESSERA_NUMBERS, or a TESSERA_CHOICE that takes numbers too.
TESSERA_API tessera_status tessera_set_numbers(tessera_parameters* parameters, const char* name,
                                               const double* values, size_t count, tessera_error** error);
/// Sets a TESSERA_TEXT or TESSERA_CHOICE.
TESSERA_API tessera_status tessera_set_text(tessera_parameters* parameters, const char* name,
                                            const char* text, tessera_error** error);
/// Sets what a line says: positional arguments, then name=value, blank-separated, as
/// tessera_operation_example.
TESSERA_API tessera_status tessera_parameters_parse(tessera_parameters* parameters, const char* line,
                                                    tessera_error** error);

/// How many images the operation takes with these parameters.
TESSERA_API tessera_status tessera_parameters_images(const tessera_parameters* parameters, size_t* count,
                                                     tessera_error** error);

/// The operation on `count` images, lowest first. `images` may be NULL where count is 0. What is wrong with
/// the parameters together, or with the images, is said here.
TESSERA_API tessera_status tessera_apply(const tessera_parameters* parameters,
                                         const tessera_image* const* images, size_t count,
                                         tessera_image** result, tessera_error** error);
/// An image made by a generator: these pixels, so many channels.
TESSERA_API tessera_status tessera_generate(const tessera_parameters* parameters,
                                            const tessera_window* window, int32_t channels,
                                            tessera_image** result, tessera_error** error);

/// Called with the share done, in [0, 1], from threads of the library but one at a time; 0 cancels, anything
/// else goes on. Must neither throw nor jump.
typedef int32_t (*tessera_progress)(double share, void* user);

/// What evaluations keep for the next ones: memory of pictures given back, and things that were prepared, as
/// tables. Several contexts live side by side and share nothing: one for each document of a host, say.
/// Results never depend on one.
typedef struct tessera_context tessera_context;
/// How much a context keeps.
typedef struct tessera_context_limits {
  size_t struct_size;  ///< sizeof(tessera_context_limits)
  uint64_t memory;     ///< bytes of pictures given back, for the next ones of their size; 0: 320 MiB
  uint64_t cache;      ///< bytes of prepared things; 0: 256 MiB
  uint64_t whole;      ///< bytes of one thing held whole; what is larger lies in a nameless file; 0: no limit
} tessera_context_limits;
/// How much it holds at a moment.
typedef struct tessera_context_use {
  size_t struct_size;  ///< sizeof(tessera_context_use)
  uint64_t memory;     ///< bytes kept for the next pictures
  uint64_t cache;      ///< bytes of prepared things
  uint64_t entries;    ///< how many prepared things
} tessera_context_use;
/// A context that keeps no more than that. `limits` may be NULL.
TESSERA_API tessera_status tessera_context_new(const tessera_context_limits* limits,
                                               tessera_context** context, tessera_error** error);
/// Frees the handle and gives back what is kept; evaluations in it must have ended. Prepared graphs in it,
/// and images, live on. NULL is fine.
TESSERA_API void tessera_context_free(tessera_context* context);
/// Keeps no more than that from here on. `context` may be NULL: the one that is used where none is named.
/// `limits` may be NULL.
TESSERA_API tessera_status tessera_context_limit(tessera_context* context,
                                                 const tessera_context_limits* limits, tessera_error** error);
/// What is kept now. `context` may be NULL: the one that is used where none is named.
TESSERA_API tessera_status tessera_context_get_use(const tessera_context* context, tessera_context_use* use,
                                                   tessera_error** error);
/// Gives back all that is kept and that nobody uses. `context` may be NULL: the one that is used where none
/// is named.
TESSERA_API tessera_status tessera_context_release(tessera_context* context, tessera_error** error);

/// How an image is evaluated. Bits of the result never depend on it.
typedef struct tessera_render_options {
  size_t struct_size;         ///< sizeof(tessera_render_options)
  int32_t threads;            ///< 0: every core
  uint64_t memory;            ///< bytes that buffers may take together; 0: 512 MiB
  tessera_progress progress;  ///< NULL: none
  void* user;                 ///< handed to progress
  tessera_context* context;   ///< who keeps memory and what is prepared; NULL: one that all share
} tessera_render_options;
/// Evaluates the pixels of `out->window`, which must lie within the image's, into the caller's memory: all
/// channels of the image, any type and strides. `options` may be NULL. After a failure the pixels may be
/// partly written.
TESSERA_API tessera_status tessera_render(const tessera_image* image, const tessera_pixels* out,
                                          const tessera_render_options* options, tessera_error** error);

/// An image made ready to be asked for regions again and again, as by a viewer: what it needs to know of
/// whole images is computed once and kept, and so is the plan for every layout of results.
typedef struct tessera_prepared tessera_prepared;
/// Computes what regions will need beforehand; `options->progress` is for that alone. `options` may be NULL.
TESSERA_API tessera_status tessera_prepare(const tessera_image* image, const tessera_render_options* options,
                                           tessera_prepared** prepared, tessera_error** error);
/// As tessera_render of the image with the options that it was prepared with, with the same bits. `progress`
/// may be NULL, and is handed `user`.
TESSERA_API tessera_status tessera_prepared_render(const tessera_prepared* prepared,
                                                   const tessera_pixels* out, tessera_progress progress,
                                                   void* user, tessera_error** error);
/// Frees the handle; no thread may be rendering it. NULL is fine.
TESSERA_API void tessera_prepared_free(tessera_prepared* prepared);

/// What is read of a file.
typedef struct tessera_read_options {
  size_t struct_size;   ///< sizeof(tessera_read_options)
  int32_t subimage;     ///< index of the part
  const char* part;     ///< or its name, which wins; NULL: none
  int32_t all_formats;  ///< not 0: formats whose readers damaged files can harm, too
} tessera_read_options;
/// A lazy image of a file: the header is read now. `options` may be NULL.
TESSERA_API tessera_status tessera_read(const char* file, const tessera_read_options* options,
                                        tessera_image** image, tessera_error** error);
/// How a file is written.
typedef struct tessera_write_options {
  size_t struct_size;  ///< sizeof(tessera_write_options)
  tessera_type type;   ///< default: the image's own; what the format has not becomes the nearest it has
  int32_t threads;     ///< 0: every core
  uint64_t memory;     ///< bytes that buffers may take together; 0: 512 MiB
  tessera_progress progress;  ///< NULL: none
  void* user;                 ///< handed to progress
  tessera_context* context;   ///< who keeps memory and what is prepared; NULL: one that all share
} tessera_write_options;
/// Evaluates and writes, in bands; the file appears whole or not at all. `options` may be NULL.
TESSERA_API tessera_status tessera_write(const tessera_image* image, const char* file,
                                         const tessera_write_options* options, tessera_error** error);

/// Which image files are read by a process of their own, which may read that file and nothing else.
typedef int32_t tessera_sandbox;
enum {
  TESSERA_SANDBOX_OFF = 0,       ///< none
  TESSERA_SANDBOX_UNLISTED = 1,  ///< those that only all_formats reads
  TESSERA_SANDBOX_ALL = 2        ///< all
};
/// What files may ask for, from whoever opens them. Seconds of an evaluation are for its progress callback to
/// count, and its memory is in its options.
typedef struct tessera_policy {
  size_t struct_size;       ///< sizeof(tessera_policy)
  int64_t pixels;           ///< most pixels of an image, voxels of a volume; 0: no limit
  int64_t channels;         ///< most channels of an image; 0: no limit
  int32_t listed_formats;   ///< not 0: all_formats has no effect, and no others are written
  int32_t configs_inside;   ///< not 0: OpenColorIO configs name files of their own folder alone
  int32_t no_output_links;  ///< not 0: outputs are not written to or through symbolic links
  tessera_sandbox sandbox;  ///< tessera_start_sandbox comes first
  int64_t reader_memory;    ///< most bytes that a process of its own takes; 0: 4 GiB
  double reader_seconds;    ///< longest that it is waited for, for a header or some rows; 0: no limit
} tessera_policy;
/// Holds for all that is opened or written from here on, by any thread. NULL: all members are 0, as at first.
TESSERA_API tessera_status tessera_set_policy(const tessera_policy* policy, tessera_error** error);
/// The one that holds.
TESSERA_API tessera_status tessera_get_policy(tessera_policy* policy, tessera_error** error);
/// The one that `tessera --safe` starts from, for files that come from strangers; it is not set yet.
TESSERA_API tessera_status tessera_safe_policy(tessera_policy* policy, tessera_error** error);
/// Makes ready what a policy's sandbox asks for: a copy of this process, as it is now, that starts the
/// others. To be called once, first thing in main(), while the process has one thread. Where the system has
/// no sandbox, reading what is to be read in one fails with TESSERA_SYSTEM.
TESSERA_API tessera_status tessera_start_sandbox(tessera_error** error);
/// Ends the copy, and whatever reads for it.
TESSERA_API void tessera_end_sandbox(void);

/// Graphs as JSON; the format stands in tessera/graph_json.h. The image as the open input of that name, where
/// a graph that it is in is written.
TESSERA_API tessera_status tessera_image_as_input(const tessera_image* image, const char* name,
                                                  tessera_image** input, tessera_error** error);
/// What the image is made of: operations and files by their names. Pixels in memory are open inputs: of their
/// name, else "image", "image2", ... `*text` is the caller's, who gives it to tessera_text_free.
TESSERA_API tessera_status tessera_graph_to_json(const tessera_image* image, char** text,
                                                 tessera_error** error);
/// Frees text that a function of this header made; NULL is fine.
TESSERA_API void tessera_text_free(char* text);
/// The name of an open input of a graph, in their order; NULL beyond the last. For tessera_text_free.
TESSERA_API tessera_status tessera_graph_input(const char* json, size_t index, char** name,
                                               tessera_error** error);
/// The graph's result, of these images for its open inputs of these names. What is wrong with the graph is
/// TESSERA_DATA and says which node and parameter. `names` and `images` may be NULL where count is 0.
TESSERA_API tessera_status tessera_graph_from_json(const char* json, const char* const* names,
                                                   const tessera_image* const* images, size_t count,
                                                   tessera_image** image, tessera_error** error);

#ifdef __cplusplus
}
#endif

#endif  // TESSERA_C_H_
