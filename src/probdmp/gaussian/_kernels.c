/* Kalman filtering of many scalar-observation systems, and likelihoods of many windows: the loops of probdmp, compiled.

   s[t] = A s[t-1] + drift[t-1] + b e[t-1],  e ~ N(0, u[t-1]),    o[t] = c s[t] + v[t],  v ~ N(0, r)

   _kernels_numpy.py says the same in NumPy, function by function, and is what this file is tested against; kernels.py chooses
   between the two. Arrays are float64 and C-contiguous; what is written to is allocated by the caller. NaN marks what was not
   observed. Functions of many systems, series or windows release the GIL, those of one tick keep it. Limited API of Python 3.11.

   The file includes itself for its loops, which are compiled for any processor, and for those with AVX2, which is chosen at run
   time: NAMED says which of the two.
*/
#ifndef NAMED
#define PY_SSIZE_T_CLEAN
#include <Python.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#if defined(__GNUC__)
#define INLINE static inline __attribute__((always_inline))
#else
#define INLINE static inline
#endif

#if defined(__GNUC__) && !defined(__clang__)
#define AS_WRITTEN __attribute__((optimize("fp-contract=off"))) /* other compilers contract expressions, not statements */
#else
#define AS_WRITTEN
#endif

#define MOST_STATES 4
#define OUTPUTS 4 /* rows of maps that are multiplied with a window at once */
#define BEFORE 1 /* the sum over all that came before a place; the one before it is over the beginning of that */
#define AHEAD 2 /* the first of the sums over what follows too */
#define ROWS 4 /* of a covariance that are changed, or factorised, at once */
#define TILE 64 /* observations of each that are brought side by side at a time */
#define LARGEST_MAGNITUDE 1e100 /* see checks.py */
#define LOG_2PI 1.8378770664093453

/* ---- Arrays ------------------------------------------------------------------------------------------------------------- */

typedef struct {
    const char *name;
    int is_output;
    int ndim;
    int is_integer;
} Spec;

typedef struct {
    Py_buffer view;
    double *data;
    const int64_t *integers;
} Array;

static void release(Array *arrays, int count)
{
    for (int i = 0; i < count; i++) PyBuffer_Release(&arrays[i].view);
}

/* All arguments as arrays of the kind, and with the number of axes, that the specs say. */
static int take(PyObject *const *arguments, Py_ssize_t given, const Spec *specs, int count, Array *arrays)
{
    if (given != count) {
        PyErr_Format(PyExc_TypeError, "expected %d arrays, got %zd", count, given);
        return -1;
    }
    for (int i = 0; i < count; i++) {
        int flags = PyBUF_C_CONTIGUOUS | PyBUF_FORMAT | (specs[i].is_output ? PyBUF_WRITABLE : 0);
        if (PyObject_GetBuffer(arguments[i], &arrays[i].view, flags) < 0) {
            release(arrays, i);
            return -1;
        }
        const Py_buffer *view = &arrays[i].view;
        const char *format = view->format ? view->format : "B";
        const int is_kind = specs[i].is_integer ? !strcmp(format, "l") || !strcmp(format, "q") : !strcmp(format, "d");
        if (view->ndim != specs[i].ndim || view->itemsize != 8 || !is_kind) {
            PyErr_Format(PyExc_ValueError, "%s: expected %s with %d axes, got %d axes of format %s", specs[i].name,
                         specs[i].is_integer ? "int64" : "float64", specs[i].ndim, view->ndim, format);
            release(arrays, i + 1);
            return -1;
        }
        arrays[i].data = view->buf;
        arrays[i].integers = view->buf;
    }
    return 0;
}

static int agree(const Array *array, const char *name, Py_ssize_t a, Py_ssize_t b, Py_ssize_t c, Py_ssize_t d)
{
    const Py_ssize_t wanted[4] = {a, b, c, d};
    for (int i = 0; i < array->view.ndim; i++)
        if (array->view.shape[i] != wanted[i]) {
            PyErr_Format(PyExc_ValueError, "%s: expected %zd along axis %d, got %zd", name, wanted[i], i, array->view.shape[i]);
            return 0;
        }
    return 1;
}

static int few_states(Py_ssize_t n)
{
    if (n >= 1 && n <= MOST_STATES) return 1;
    PyErr_Format(PyExc_ValueError, "expected 1 to %d states, got %zd", MOST_STATES, n);
    return 0;
}

/* Calls BODY with n as a constant, so that loops over states unroll. */
#define WITH_STATES(n, BODY)                                                                                                  \
    switch (n) {                                                                                                              \
    case 1: BODY(1); break;                                                                                                   \
    case 2: BODY(2); break;                                                                                                   \
    case 3: BODY(3); break;                                                                                                   \
    case 4: BODY(4); break;                                                                                                   \
    }

/* Begins to bring a line into the cache; where there is no memory nothing happens. */
#if defined(__GNUC__)
#define fetch(address) __builtin_prefetch(address)
#else
#define fetch(address) (void)(address)
#endif

/* Series side by side, in the registers of the processor where the compiler has a type for them. */
#if defined(__GNUC__)
#pragma GCC diagnostic ignored "-Wpsabi" /* vectors are passed between inlined functions only */
typedef double Vector __attribute__((vector_size(32)));
typedef double Anywhere __attribute__((vector_size(32), aligned(8), may_alias)); /* in memory */
#define PARTS 2
#define UNROLL _Pragma("GCC unroll 4")
typedef long long Mask __attribute__((vector_size(32)));
#define MASK Mask
#if defined(__has_builtin)
#if __has_builtin(__builtin_shufflevector)
#define SHUFFLE __builtin_shufflevector
#endif
#endif
#else
typedef double Vector, Anywhere;
#define PARTS 4
#define UNROLL
#endif
typedef struct {
    Vector part[PARTS];
} Lane;
#define WIDTH ((int)(sizeof(Lane) / sizeof(double)))

typedef struct {
    Py_ssize_t n_times, n_systems;
    const double *a, *b, *drifts, *u, *c, *r, *m0, *v0, *observed;
    double *means, *covariances, *innovations, *variances, *log_likelihoods, *gains;
} Systems;

/* What filtered observations say of the states before them; see `smooth_backwards`. */
typedef struct {
    Py_ssize_t n_times, n_systems;
    const double *a, *scores, *informations, *retentions, *means, *covariances;
    double *smoothed_means, *smoothed_covariances;
} Filtered;

/* What is filtered is the deviation from the path expected without observations:
   d[t] = F[t-1] d[t-1] + g[t-1] y[t-1],  F = A - g c,  g = A K,    e[t] = y[t] - c d[t],  y = o - path */
typedef struct {
    Py_ssize_t n_series, n_times, n_dof, n_paths;
    const double *closed, *feedback, *sensor, *precisions, *observed, *paths;
} Series;

/* Times of so many degrees of freedom that are brought side by side at once. */
static Py_ssize_t longest_tile(Py_ssize_t n_dof) { return n_dof < TILE ? TILE / n_dof : 1; }

/* Windows of n executions, each after the linear maps of its own place, one for each account of it. */
typedef struct {
    Py_ssize_t n, n_values, n_places, n_inputs, n_maps, n_outputs, n_mapped, n_accounts, n_sums;
    const double *values, *maps;
    const int64_t *rows, *which, *ends, *reach, *wanted;
    const double *penalties; /* of the least squares */
    const double *scales;    /* of mixtures */
    const int64_t *n_halves;
    double inverse;
    Py_ssize_t central;
    int64_t *extents, *own_extents; /* to work in: so are the following */
    double *packed, *own, *window, *sums, *more;
} Windows;

/* What weighs another account of windows: none, or that they are at rest, or other windows. */
typedef struct {
    Py_ssize_t n_dof;
    const double *stds, *constants; /* of rest */
    const Windows *windows;
    double *floors;       /* up to which it need not be known; they rise to what is found, up to a limit */
    const double *limits;
} Contrary;

/* Outputs of maps of one window, under some accounts of it. */
typedef struct {
    Py_ssize_t n_outputs, n_inputs, n_accounts, n_sums;
    const double *maps, *window;
    const int64_t *which, *reach, *ends;
} OneWindow;

/* Recordings (N, T, S), and points between their samples: (before - after) beyond + after, less the start, in ranges. */
typedef struct {
    Py_ssize_t n, n_times, n_signals, n_points;
    const double *values, *limits, *starts, *ranges, *beyond;
    const int64_t *after;
} Recordings;

/* Points that were measured on paths, with noise, under accounts of where they are and how far they were pushed aside; see `whiten`
   in _recordings_numpy.py. */
typedef struct {
    Py_ssize_t n_paths, n_accounts, n_points, n_dof, n_numbers; /* accounts of each path; numbers of a path */
    const double *covariances, *variances, *aside, *residuals;
    const int64_t *phases;
    double *white, *logarithms;
    double *triangle, *pushes; /* to work in */
    int64_t *numbers;
} Points;

/* Groups of states that move on top of z, which stands still; see augmented_steps.py. There are n_outputs = n_groups size outputs. */
typedef struct {
    Py_ssize_t n_groups, size, n_states, width, block, n_outputs, n_latent, n_gains;
    const double *observation, *path, *designs, *next_path, *next_designs, *sensors, *noise, *transition, *driven;
    const double *mean, *covariance, *offset, *loading, *spread; /* of a covariance of z the lower triangle, here and below */
    const int64_t *believed;
    double *next_mean, *next_covariance, *next_offset, *next_loading, *next_spread, *states, *state_covariances;
    double *innovations, *innovation_covariance, *log_likelihoods, *gains, *deviation_gains;
    int64_t *fused;
    double *looks, *errors, *white, *totals, *factor, *shown, *rows, *columns, *some; /* to work in */
} Augmented;

/* ---- Loops, for any processor and for AVX2 ------------------------------------------------------------------------------ */

/* Each of them has two names. */
#define predict NAMED(predict)
#define update NAMED(update)
#define filter_system NAMED(filter_system)
#define load NAMED(load)
#define quotient NAMED(quotient)
#define plus_product NAMED(plus_product)
#define where_seen NAMED(where_seen)
#define take_above NAMED(take_above)
#define step_lane NAMED(step_lane)
#define store NAMED(store)
#define everywhere NAMED(everywhere)
#define times NAMED(times)
#define plus_number NAMED(plus_number)
#define smaller NAMED(smaller)
#define logarithm NAMED(logarithm)
#define plus NAMED(plus)
#define bring_together NAMED(bring_together)
#define transpose NAMED(transpose)
#define take_apart NAMED(take_apart)
#define filter_tile NAMED(filter_tile)
#define innovation_of NAMED(innovation_of)
#define go_on NAMED(go_on)
#define score_tile NAMED(score_tile)
#define smooth_tile NAMED(smooth_tile)
#define filter_all NAMED(filter_all)
#define step_all NAMED(step_all)
#define score_all NAMED(score_all)
#define smooth_all NAMED(smooth_all)

#define product NAMED(product)
#define smooth_system NAMED(smooth_system)
#define smooth_each NAMED(smooth_each)

#define pack NAMED(pack)
#define square_outputs NAMED(square_outputs)
#define mix_lane NAMED(mix_lane)
#define least_lane NAMED(least_lane)
#define log_density NAMED(log_density)
#define some_of NAMED(some_of)
#define gather NAMED(gather)
#define put NAMED(put)
#define look_at_lane NAMED(look_at_lane)
#define any_above NAMED(any_above)
#define square_next NAMED(square_next)
#define mapped_at NAMED(mapped_at)
#define at_rest NAMED(at_rest)
#define last_above NAMED(last_above)
#define weigh_rest NAMED(weigh_rest)
#define weigh_windows NAMED(weigh_windows)
#define pack_place NAMED(pack_place)
#define weigh_all NAMED(weigh_all)
#define look_at_windows NAMED(look_at_windows)

#define minus_product NAMED(minus_product)
#define root NAMED(root)
#define gather_points NAMED(gather_points)
#define push_aside NAMED(push_aside)
#define forget_unseen NAMED(forget_unseen)
#define solve_column NAMED(solve_column)
#define factorise_rows NAMED(factorise_rows)
#define factorise_lane NAMED(factorise_lane)
#define whiten_all NAMED(whiten_all)

#define square_window NAMED(square_window)

#define look_for_odd NAMED(look_for_odd)
#define draw_lines NAMED(draw_lines)

#define dot NAMED(dot)
#define add_multiple NAMED(add_multiple)
#define sum_of NAMED(sum_of)
#define both_ways NAMED(both_ways)
#define multiply NAMED(multiply)
#define multiply_transposed NAMED(multiply_transposed)
#define triangle_times NAMED(triangle_times)
#define factorize NAMED(factorize)
#define solve NAMED(solve)
#define look_at_group NAMED(look_at_group)
#define spread_looks NAMED(spread_looks)
#define compare_outputs NAMED(compare_outputs)
#define whiten_tick NAMED(whiten_tick)
#define share_density NAMED(share_density)
#define know_more NAMED(know_more)
#define move_group NAMED(move_group)
#define expect_group NAMED(expect_group)
#define augmented_all NAMED(augmented_all)

#define NAMED(name) name##_anywhere
#include "_kernels.c"
#undef NAMED

#if defined(__GNUC__) && defined(__x86_64__) && !defined(__clang__)
#pragma GCC push_options
#pragma GCC target("arch=haswell")
#define NAMED(name) name##_avx2
#include "_kernels.c"
#undef NAMED
#pragma GCC pop_options
#define CHOOSE(name) (has_avx2 ? name##_avx2 : name##_anywhere)
static int has_avx2;
static void look_at_processor(void) { has_avx2 = __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma"); }
#else
#define CHOOSE(name) name##_anywhere
static void look_at_processor(void) {}
#endif
#undef augmented_all
#undef filter_all
#undef look_at_windows
#undef weigh_all
#undef whiten_all
#undef square_window
#undef look_for_odd
#undef draw_lines
#undef step_all
#undef score_all
#undef smooth_all
#undef smooth_each

/* ---- filter_systems ----------------------------------------------------------------------------------------------------- */

static PyObject *filter_systems(PyObject *module, PyObject *const *arguments, Py_ssize_t given)
{
    static const Spec specs[] = {
        {"transition", 0, 3, 0}, {"input_vector", 0, 2, 0}, {"drifts", 0, 3, 0}, {"input_variances", 0, 2, 0},
        {"sensor", 0, 2, 0}, {"noise", 0, 1, 0}, {"initial_mean", 0, 2, 0}, {"initial_covariance", 0, 3, 0},
        {"observations", 0, 2, 0}, {"means", 1, 3, 0}, {"covariances", 1, 4, 0}, {"innovations", 1, 2, 0},
        {"variances", 1, 2, 0}, {"log_likelihoods", 1, 2, 0}, {"gains", 1, 3, 0},
    };
    enum { COUNT = sizeof(specs) / sizeof(specs[0]) };
    Array x[COUNT];
    if (take(arguments, given, specs, COUNT, x) < 0) return NULL;
    const Py_ssize_t t = x[8].view.shape[0], m = x[8].view.shape[1], n = x[0].view.shape[1];
    const Py_ssize_t wanted[COUNT][4] = {
        {m, n, n, 0}, {m, n, 0, 0}, {t - 1, m, n, 0}, {t - 1, m, 0, 0}, {m, n, 0, 0}, {m, 0, 0, 0}, {m, n, 0, 0},
        {m, n, n, 0}, {t, m, 0, 0}, {t, m, n, 0}, {t, m, n, n}, {t, m, 0, 0}, {t, m, 0, 0}, {t, m, 0, 0}, {t, m, n, 0},
    };
    int fits = few_states(n);
    for (int i = 0; fits && i < COUNT; i++)
        fits = agree(&x[i], specs[i].name, wanted[i][0], wanted[i][1], wanted[i][2], wanted[i][3]);
    if (fits) {
        Systems systems = {t, m, x[0].data, x[1].data, x[2].data, x[3].data, x[4].data, x[5].data, x[6].data, x[7].data,
                           x[8].data, x[9].data, x[10].data, x[11].data, x[12].data, x[13].data, x[14].data};
        Py_BEGIN_ALLOW_THREADS
        CHOOSE(filter_all)((int)n, &systems);
        Py_END_ALLOW_THREADS
    }
    release(x, COUNT);
    if (!fits) return NULL;
    Py_RETURN_NONE;
}

/* ---- PreparedSteps ------------------------------------------------------------------------------------------------------ */

/* Systems and their inputs, checked and held once, so that a tick has one array to look at. */
typedef struct {
    PyObject_HEAD
    Array arrays[2]; /* system, inputs */
    int n_held;
    PyTypeObject *kind; /* of these arrays: others, whose numbers may not be what they say, are not taken */
    Py_ssize_t n_states, n_outputs, stride, n_steps, n_bytes;
} PreparedSteps;

static int hold(PreparedSteps *self, PyObject *const *arguments, Py_ssize_t n_outputs)
{
    static const Spec specs[] = {{"system", 0, 2, 0}, {"inputs", 0, 3, 0}};
    if (take(arguments, 2, specs, 2, self->arrays) < 0) return -1;
    self->n_held = 2;
    const Py_ssize_t *shape = self->arrays[1].view.shape, n = shape[1] - 1, stride = shape[2];
    if (!few_states(n) || !agree(&self->arrays[0], "system", n * n + 2 * n + 1, stride, 0, 0)) return -1;
    if (stride % WIDTH || n_outputs < 1 || n_outputs > stride || n_outputs <= stride - WIDTH) {
        PyErr_Format(PyExc_ValueError, "expected rows padded from %zd to a multiple of %d, got %zd", n_outputs, WIDTH, stride);
        return -1;
    }
    self->kind = (PyTypeObject *)Py_NewRef((PyObject *)Py_TYPE(arguments[0]));
    self->n_states = n;
    self->n_outputs = n_outputs;
    self->stride = stride;
    self->n_steps = shape[0];
    self->n_bytes = (n * n + n + 3) * stride * (Py_ssize_t)sizeof(double);
    return 0;
}

static PyObject *prepare_steps(PyTypeObject *type, PyObject *arguments, PyObject *named)
{
    PyObject *arrays[2];
    Py_ssize_t n_outputs;
    if (named != NULL && PyDict_Size(named)) {
        PyErr_SetString(PyExc_TypeError, "expected arguments without names");
        return NULL;
    }
    if (!PyArg_ParseTuple(arguments, "OOn", &arrays[0], &arrays[1], &n_outputs)) return NULL;
    PreparedSteps *self = (PreparedSteps *)PyType_GenericAlloc(type, 0);
    if (self != NULL && hold(self, arrays, n_outputs) < 0) {
        Py_DECREF(self);
        return NULL;
    }
    return (PyObject *)self;
}

static void forget_steps(PyObject *object)
{
    PreparedSteps *self = (PreparedSteps *)object;
    PyTypeObject *type = Py_TYPE(object);
    release(self->arrays, self->n_held);
    Py_XDECREF((PyObject *)self->kind);
    PyObject_Free(object);
    Py_DECREF((PyObject *)type);
}

/* (n_seen, n_outputs, log-likelihood, record); takes over the record. */
static PyObject *told_of_step(const PreparedSteps *self, Py_ssize_t n_seen, double log_likelihood, PyObject *record)
{
    PyObject *told = PyTuple_New(4), *parts[4];
    parts[0] = PyLong_FromSsize_t(n_seen);
    parts[1] = PyLong_FromSsize_t(self->n_outputs);
    parts[2] = PyFloat_FromDouble(log_likelihood);
    parts[3] = record;
    int has_memory = told != NULL;
    for (int i = 0; i < 4; i++) {
        has_memory = has_memory && parts[i] != NULL;
        if (told != NULL)
            PyTuple_SetItem(told, i, parts[i]);
        else
            Py_XDECREF(parts[i]);
    }
    if (has_memory) return told;
    Py_XDECREF(told);
    return NULL;
}

static PyObject *take_step(PyObject *object, PyObject *const *arguments, Py_ssize_t given)
{
    const PreparedSteps *self = (PreparedSteps *)object;
    if (given != 3) {
        PyErr_Format(PyExc_TypeError, "expected an observation, a record and a step, got %zd arguments", given);
        return NULL;
    }
    const Py_ssize_t step = PyLong_AsSsize_t(arguments[2]), n = self->n_states;
    if (step == -1 && PyErr_Occurred()) return NULL;
    if (step < 0 || step >= self->n_steps) {
        PyErr_Format(PyExc_ValueError, "expected a step of %zd, got %zd", self->n_steps, step);
        return NULL;
    }
    if (!PyBytes_Check(arguments[1]) || PyBytes_Size(arguments[1]) != self->n_bytes) {
        PyErr_Format(PyExc_ValueError, "before: expected a record of %zd bytes", self->n_bytes);
        return NULL;
    }
    Py_buffer view;
    if (Py_TYPE(arguments[0]) != self->kind) Py_RETURN_NONE;
    if (PyObject_GetBuffer(arguments[0], &view, PyBUF_C_CONTIGUOUS | PyBUF_FORMAT) < 0) {
        PyErr_Clear();
        Py_RETURN_NONE;
    }
    PyObject *record = NULL;
    Py_ssize_t n_seen = -1;
    double log_likelihood = 0;
    const int fits = view.ndim == 1 && view.shape[0] == self->n_outputs && view.format && !strcmp(view.format, "d");
    if (fits && (record = PyBytes_FromStringAndSize(NULL, self->n_bytes)) != NULL) {
        const double *now = self->arrays[1].data + step * (n + 1) * self->stride;
        n_seen = CHOOSE(step_all)((int)n, self->n_outputs, self->stride, self->arrays[0].data, now, view.buf,
                                  (const double *)PyBytes_AsString(arguments[1]), (double *)PyBytes_AsString(record),
                                  &log_likelihood);
    }
    PyBuffer_Release(&view);
    if (fits && record == NULL) return NULL;
    if (n_seen >= 0) return told_of_step(self, n_seen, log_likelihood, record);
    Py_XDECREF(record);
    Py_RETURN_NONE;
}

static PyMethodDef step_methods[] = {
    {"take", (PyCFunction)(void (*)(void))take_step, METH_FASTCALL, NULL},
    {NULL, NULL, 0, NULL},
};

static PyType_Slot step_slots[] = {
    {Py_tp_new, (void *)prepare_steps}, {Py_tp_dealloc, (void *)forget_steps}, {Py_tp_methods, step_methods}, {0, NULL},
};

static PyType_Spec step_spec = {"probdmp.gaussian._kernels.PreparedSteps", sizeof(PreparedSteps), 0, Py_TPFLAGS_DEFAULT, step_slots};

/* ---- Series that share their gains -------------------------------------------------------------------------------------- */

static int series_fit(const Array *x, Series *s, Py_ssize_t *n_states)
{
    const Py_ssize_t n = x[0].view.shape[2], t = x[4].view.shape[1], d = x[4].view.shape[2], count = x[4].view.shape[0];
    const Py_ssize_t n_paths = x[5].view.shape[0];
    *s = (Series){count, t, d, n_paths, x[0].data, x[1].data, x[2].data, x[3].data, x[4].data, x[5].data};
    *n_states = n;
    if (d < 1) {
        PyErr_SetString(PyExc_ValueError, "expected at least one degree of freedom, got none");
        return 0;
    }
    return few_states(n) && agree(&x[0], "closed_loop", t, d, n, n) && agree(&x[1], "feedback", t, d, n, 0)
           && agree(&x[2], "sensor", d, n, 0, 0) && agree(&x[3], "precisions", t, d, 0, 0)
           && agree(&x[5], "paths", n_paths == 1 ? 1 : count, t, d, 0);
}

#define SERIES {"closed_loop", 0, 4, 0}, {"feedback", 0, 3, 0}, {"sensor", 0, 2, 0}, {"precisions", 0, 2, 0}, {"observations", 0, 3, 0}, \
               {"paths", 0, 3, 0}

static PyObject *squared_innovations(PyObject *module, PyObject *const *arguments, Py_ssize_t given)
{
    static const Spec specs[] = {SERIES, {"squares", 1, 2, 0}};
    enum { COUNT = sizeof(specs) / sizeof(specs[0]) };
    Array x[COUNT];
    Series s;
    Py_ssize_t n;
    if (take(arguments, given, specs, COUNT, x) < 0) return NULL;
    int done = series_fit(x, &s, &n) && agree(&x[6], "squares", s.n_series, s.n_dof, 0, 0);
    if (done) {
        const Py_ssize_t longest = longest_tile(s.n_dof);
        double *work = malloc((longest * s.n_dof + s.n_dof * (n + 1)) * WIDTH * sizeof(double));
        done = work != NULL;
        if (done) {
            Py_BEGIN_ALLOW_THREADS
            CHOOSE(score_all)((int)n, &s, work, work + longest * s.n_dof * WIDTH, x[6].data);
            Py_END_ALLOW_THREADS
        } else
            PyErr_NoMemory();
        free(work);
    }
    release(x, COUNT);
    if (!done) return NULL;
    Py_RETURN_NONE;
}

static PyObject *smoothed_states(PyObject *module, PyObject *const *arguments, Py_ssize_t given)
{
    static const Spec specs[] = {SERIES, {"predicted_covariances", 0, 4, 0}, {"path_states", 0, 3, 0}, {"smoothed", 1, 4, 0}};
    enum { COUNT = sizeof(specs) / sizeof(specs[0]) };
    Array x[COUNT];
    Series s;
    Py_ssize_t n;
    if (take(arguments, given, specs, COUNT, x) < 0) return NULL;
    int done = series_fit(x, &s, &n);
    done = done && agree(&x[6], "predicted_covariances", s.n_times, s.n_dof, n, n)
           && agree(&x[7], "path_states", s.n_times, s.n_dof, n, 0) && agree(&x[8], "smoothed", s.n_series, s.n_times, s.n_dof, n);
    if (done) {
        const Py_ssize_t longest = longest_tile(s.n_dof);
        double *work = malloc((longest * (n + 1) + n + s.n_times * (n + 1)) * s.n_dof * WIDTH * sizeof(double));
        done = work != NULL;
        if (done) {
            Py_BEGIN_ALLOW_THREADS
            CHOOSE(smooth_all)((int)n, &s, x[6].data, x[7].data, work, x[8].data);
            Py_END_ALLOW_THREADS
        } else
            PyErr_NoMemory();
        free(work);
    }
    release(x, COUNT);
    if (!done) return NULL;
    Py_RETURN_NONE;
}

/* ---- smooth_backwards --------------------------------------------------------------------------------------------------- */

static PyObject *smooth_backwards(PyObject *module, PyObject *const *arguments, Py_ssize_t given)
{
    static const Spec specs[] = {
        {"transition", 0, 3, 0}, {"scores", 0, 3, 0}, {"informations", 0, 4, 0}, {"retentions", 0, 4, 0}, {"means", 0, 3, 0},
        {"covariances", 0, 4, 0}, {"smoothed_means", 1, 3, 0}, {"smoothed_covariances", 1, 4, 0},
    };
    enum { COUNT = sizeof(specs) / sizeof(specs[0]) };
    Array x[COUNT];
    if (take(arguments, given, specs, COUNT, x) < 0) return NULL;
    const Py_ssize_t t = x[1].view.shape[0], m = x[0].view.shape[0], n = x[0].view.shape[1];
    int fits = few_states(n) && agree(&x[0], specs[0].name, m, n, n, 0);
    for (int i = 1; fits && i < COUNT; i++) fits = agree(&x[i], specs[i].name, t, m, n, n);
    if (fits) {
        Filtered filtered = {t, m, x[0].data, x[1].data, x[2].data, x[3].data, x[4].data, x[5].data, x[6].data, x[7].data};
        Py_BEGIN_ALLOW_THREADS
        CHOOSE(smooth_each)((int)n, &filtered);
        Py_END_ALLOW_THREADS
    }
    release(x, COUNT);
    if (!fits) return NULL;
    Py_RETURN_NONE;
}

/* ---- Windows ------------------------------------------------------------------------------------------------------------ */

#define WINDOWS {"values", 0, 2, 0}, {"rows", 0, 2, 1}, {"maps", 0, 3, 0}, {"which", 0, 2, 1}, {"ends", 0, 1, 1}, \
                {"reach", 0, 1, 1}, {"wanted", 0, 1, 1}

/* Of the first sums nothing is written. `n_found` numbers are. */
static int windows_fit(const Array *x, Py_ssize_t n_found, Py_ssize_t n_left_out, Windows *s)
{
    *s = (Windows){
        .n = x[0].view.shape[1], .n_values = x[0].view.shape[0], .n_places = x[1].view.shape[0], .n_inputs = x[1].view.shape[1],
        .n_maps = x[2].view.shape[0], .n_outputs = x[2].view.shape[1], .n_mapped = x[3].view.shape[0],
        .n_accounts = x[3].view.shape[1], .n_sums = x[4].view.shape[0], .values = x[0].data, .maps = x[2].data,
        .rows = x[1].integers, .which = x[3].integers, .ends = x[4].integers, .reach = x[5].integers, .wanted = x[6].integers,
    };
    if (!agree(&x[2], "maps", s->n_maps, s->n_outputs, s->n_inputs, 0) || !agree(&x[5], "reach", s->n_outputs, 0, 0, 0)
        || !agree(&x[6], "wanted", s->n_sums, 0, 0, 0))
        return 0;
    int is_sound = s->n_sums > 0 && s->n_sums > n_left_out && s->n_mapped > 0 && s->n_inputs > 0 && s->n_accounts > 0;
    Py_ssize_t size = 0;
    for (Py_ssize_t j = 0; is_sound && j < s->n_sums; j++) {
        is_sound = s->ends[j] > (j ? s->ends[j - 1] : 0) && s->ends[j] <= s->n_outputs && s->wanted[j] >= 0
                   && s->wanted[j] <= (j ? s->wanted[j - 1] : s->n_places);
        size += j < n_left_out ? 0 : s->wanted[j] * s->n;
    }
    for (Py_ssize_t i = 0; is_sound && i < s->n_outputs; i++)
        is_sound = s->reach[i] >= (i ? s->reach[i - 1] : 0) && s->reach[i] <= s->n_inputs;
    for (Py_ssize_t i = 0; is_sound && i < s->n_places * s->n_inputs; i++) is_sound = s->rows[i] >= 0 && s->rows[i] < s->n_values;
    for (Py_ssize_t i = 0; is_sound && i < s->n_mapped * s->n_accounts; i++)
        is_sound = s->which[i] >= 0 && s->which[i] < s->n_maps;
    if (!is_sound || n_found != size) {
        PyErr_SetString(PyExc_ValueError, "rows, maps, which, ends, reach, wanted and found do not belong together");
        return 0;
    }
    return 1;
}

/* Room to work in for `n_more` lanes, that has to be freed; NULL without memory. */
static double *room_for(Windows *s, Py_ssize_t n_more)
{
    const Py_ssize_t groups = s->n_outputs * s->n_accounts / OUTPUTS + s->n_sums, own = s->n_outputs / OUTPUTS + s->n_sums;
    const Py_ssize_t k = s->n_inputs, lanes = (k + s->n_accounts + n_more + 1) * WIDTH;
    double *work = malloc(((groups + own) * OUTPUTS * k + lanes) * sizeof(double) + (groups + own) * sizeof(int64_t));
    if (work == NULL) {
        PyErr_NoMemory();
        return NULL;
    }
    s->window = work + (-(uintptr_t)work / sizeof(double)) % WIDTH; /* where a lane begins with a line of the cache */
    s->sums = s->window + k * WIDTH;
    s->more = s->sums + s->n_accounts * WIDTH;
    s->packed = s->more + n_more * WIDTH;
    s->own = s->packed + groups * OUTPUTS * k;
    s->extents = (int64_t *)(s->own + own * OUTPUTS * k);
    s->own_extents = s->extents + groups;
    return work;
}

/* Looks at windows that fit; 0 without memory. */
static int look(Windows *s, double *found)
{
    double *work = room_for(s, 0);
    if (work == NULL) return 0;
    Py_BEGIN_ALLOW_THREADS
    CHOOSE(look_at_windows)(s, found);
    Py_END_ALLOW_THREADS
    free(work);
    return 1;
}

/* Windows of several accounts that are mixed with scales. */
static int mixtures_fit(const Array *scales, const Array *n_halves, double freedom, Windows *s)
{
    if (!agree(scales, "scales", s->n_mapped, s->n_sums, s->n_accounts, 0) || !agree(n_halves, "n_halves", s->n_sums, 0, 0, 0))
        return 0;
    s->scales = scales->data;
    s->n_halves = n_halves->integers;
    s->inverse = 1 / freedom;
    return 1;
}

static PyObject *least_squares(PyObject *module, PyObject *const *arguments, Py_ssize_t given)
{
    static const Spec specs[] = {WINDOWS, {"penalties", 0, 1, 0}, {"found", 1, 1, 0}};
    enum { COUNT = sizeof(specs) / sizeof(specs[0]) };
    Array x[COUNT];
    Windows s;
    if (take(arguments, given, specs, COUNT, x) < 0) return NULL;
    int done = windows_fit(x, x[COUNT - 1].view.shape[0], 0, &s) && agree(&x[7], "penalties", s.n_accounts, 0, 0, 0);
    if (done) {
        s.penalties = x[7].data;
        done = look(&s, x[COUNT - 1].data);
    }
    release(x, COUNT);
    if (!done) return NULL;
    Py_RETURN_NONE;
}

/* Two more arguments than arrays: the degrees of freedom of mixtures, and which of the accounts is asked first. */
static int two_numbers(PyObject *const *arguments, Py_ssize_t given, int n_arrays, double *freedom, Py_ssize_t *central)
{
    if (given != n_arrays + 2) {
        PyErr_Format(PyExc_TypeError, "expected %d arrays and two numbers, got %zd arguments", n_arrays, given);
        return -1;
    }
    *freedom = PyFloat_AsDouble(arguments[n_arrays]);
    if (PyErr_Occurred()) return -1;
    *central = PyLong_AsSsize_t(arguments[n_arrays + 1]);
    return PyErr_Occurred() ? -1 : 0;
}

static int has_account(const Windows *s, Py_ssize_t central)
{
    if (central >= 0 && central < s->n_accounts) return 1;
    PyErr_Format(PyExc_ValueError, "expected one of %zd accounts as the central one, got %zd", s->n_accounts, central);
    return 0;
}

/* Whether what follows what came BEFORE are further points of as many degrees of freedom as the place before them has. */
static int points_fit(const Windows *s, Py_ssize_t d)
{
    int is_sound = d > 0 && s->ends[BEFORE] >= d && s->n_inputs >= s->n_outputs;
    for (Py_ssize_t j = AHEAD; is_sound && j < s->n_sums; j++) is_sound = (s->ends[j] - s->ends[BEFORE]) % d == 0;
    if (!is_sound) PyErr_SetString(PyExc_ValueError, "ends, maps and stds do not belong together");
    return is_sound;
}

/* Weighs windows that fit against their contrary; 0 without memory. */
static int weigh(Windows *s, Windows *other, Contrary *contrary, double *found)
{
    double *work = room_for(s, contrary->n_dof + 2 * s->n_sums), *further = other && work ? room_for(other, 0) : NULL;
    const int has_room = work != NULL && (other == NULL || further != NULL);
    if (has_room) {
        if (other) other->window = s->window;
        contrary->windows = other;
        Py_BEGIN_ALLOW_THREADS
        CHOOSE(weigh_all)(s, contrary, found);
        Py_END_ALLOW_THREADS
    }
    free(further);
    free(work);
    return has_room;
}

static PyObject *window_evidence(PyObject *module, PyObject *const *arguments, Py_ssize_t given)
{
    static const Spec specs[] = {WINDOWS, {"scales", 0, 3, 0}, {"n_halves", 0, 1, 1}, {"stds", 0, 1, 0}, {"constants", 0, 1, 0},
                                 {"floors", 1, 2, 0}, {"limits", 0, 1, 0}, {"found", 1, 1, 0}};
    enum { COUNT = sizeof(specs) / sizeof(specs[0]) };
    Array x[COUNT];
    Windows s;
    double freedom;
    Py_ssize_t central;
    if (two_numbers(arguments, given, COUNT, &freedom, &central) < 0 || take(arguments, COUNT, specs, COUNT, x) < 0) return NULL;
    int done = windows_fit(x, x[COUNT - 1].view.shape[0], AHEAD, &s) && mixtures_fit(&x[7], &x[8], freedom, &s)
               && has_account(&s, central) && points_fit(&s, x[9].view.shape[0])
               && agree(&x[10], "constants", s.n_sums - AHEAD, 0, 0, 0) && agree(&x[11], "floors", s.n_sums - AHEAD, s.n, 0, 0)
               && agree(&x[12], "limits", s.n_sums - AHEAD, 0, 0, 0);
    if (done) {
        Contrary rest = {.n_dof = x[9].view.shape[0], .stds = x[9].data, .constants = x[10].data, .floors = x[11].data,
                         .limits = x[12].data};
        s.central = central;
        done = weigh(&s, NULL, &rest, x[COUNT - 1].data);
    }
    release(x, COUNT);
    if (!done) return NULL;
    Py_RETURN_NONE;
}

static PyObject *window_ratios(PyObject *module, PyObject *const *arguments, Py_ssize_t given)
{
    static const Spec specs[] = {WINDOWS, {"scales", 0, 3, 0}, {"n_halves", 0, 1, 1}, {"other_maps", 0, 3, 0}, {"other_which", 0, 2, 1},
                                 {"other_reach", 0, 1, 1}, {"other_scales", 0, 3, 0}, {"floors", 1, 1, 0}, {"limits", 0, 1, 0},
                                 {"found", 1, 1, 0}};
    enum { COUNT = sizeof(specs) / sizeof(specs[0]) };
    Array x[COUNT];
    Windows s, other;
    double freedom;
    Py_ssize_t central;
    if (two_numbers(arguments, given, COUNT, &freedom, &central) < 0 || take(arguments, COUNT, specs, COUNT, x) < 0) return NULL;
    const Array others[] = {x[0], x[1], x[9], x[10], x[4], x[11], x[6]};
    const Py_ssize_t size = x[COUNT - 1].view.shape[0];
    int done = windows_fit(x, size, x[4].view.shape[0] - 1, &s) && windows_fit(others, size, x[4].view.shape[0] - 1, &other)
               && mixtures_fit(&x[7], &x[8], freedom, &s) && mixtures_fit(&x[12], &x[8], freedom, &other)
               && has_account(&s, central) && agree(&x[13], "floors", s.n, 0, 0, 0) && agree(&x[14], "limits", 1, 0, 0, 0);
    if (done) {
        Contrary windows = {.floors = x[13].data, .limits = x[14].data};
        s.central = central;
        done = weigh(&s, &other, &windows, x[COUNT - 1].data);
    }
    release(x, COUNT);
    if (!done) return NULL;
    Py_RETURN_NONE;
}

/* ---- One window --------------------------------------------------------------------------------------------------------- */

static PyObject *window_sums(PyObject *module, PyObject *const *arguments, Py_ssize_t given)
{
    static const Spec specs[] = {{"maps", 0, 3, 0}, {"which", 0, 1, 1}, {"reach", 0, 1, 1}, {"window", 0, 1, 0},
                                 {"ends", 0, 1, 1}, {"sums", 1, 2, 0}};
    enum { COUNT = sizeof(specs) / sizeof(specs[0]) };
    Array x[COUNT];
    if (take(arguments, given, specs, COUNT, x) < 0) return NULL;
    const OneWindow s = {
        .n_outputs = x[0].view.shape[1], .n_inputs = x[0].view.shape[2], .n_accounts = x[1].view.shape[0],
        .n_sums = x[4].view.shape[0] - 1, .maps = x[0].data, .which = x[1].integers, .reach = x[2].integers,
        .window = x[3].data, .ends = x[4].integers,
    };
    const int fits = agree(&x[2], "reach", s.n_outputs, 0, 0, 0) && agree(&x[5], "sums", s.n_sums, s.n_accounts, 0, 0);
    int is_sound = fits && x[3].view.shape[0] <= s.n_inputs && s.ends[0] >= 0 && s.ends[s.n_sums] <= s.n_outputs;
    for (Py_ssize_t a = 0; is_sound && a < s.n_accounts; a++) is_sound = s.which[a] >= 0 && s.which[a] < x[0].view.shape[0];
    for (Py_ssize_t j = 0; is_sound && j < s.n_sums; j++) is_sound = s.ends[j] < s.ends[j + 1];
    for (Py_ssize_t i = is_sound ? s.ends[0] : 0; is_sound && i < s.ends[s.n_sums]; i++)
        is_sound = s.reach[i] >= 0 && s.reach[i] <= x[3].view.shape[0];
    if (is_sound) CHOOSE(square_window)(&s, x[5].data);
    release(x, COUNT);
    if (is_sound) Py_RETURN_NONE;
    if (fits) PyErr_SetString(PyExc_ValueError, "maps, which, reach, window and ends do not belong together");
    return NULL;
}

/* ---- Points of paths ---------------------------------------------------------------------------------------------------- */

static PyObject *whiten(PyObject *module, PyObject *const *arguments, Py_ssize_t given)
{
    static const Spec specs[] = {
        {"covariances", 0, 3, 0}, {"variances", 0, 2, 0}, {"phases", 0, 3, 1}, {"aside", 0, 3, 0}, {"residuals", 0, 4, 0},
        {"white", 1, 4, 0}, {"logarithms", 1, 4, 0},
    };
    enum { COUNT = sizeof(specs) / sizeof(specs[0]) };
    Array x[COUNT];
    if (take(arguments, given, specs, COUNT, x) < 0) return NULL;
    const Py_ssize_t k = x[4].view.shape[0], e = x[4].view.shape[1], p = x[4].view.shape[2], d = x[4].view.shape[3], n = p * d;
    Points s = {
        .n_paths = k, .n_accounts = e, .n_points = p, .n_dof = d, .n_numbers = x[0].view.shape[1], .covariances = x[0].data,
        .variances = x[1].data, .phases = x[2].integers, .aside = x[3].data, .residuals = x[4].data, .white = x[5].data,
        .logarithms = x[6].data,
    };
    int is_positive = 0, done = agree(&x[0], "covariances", k, s.n_numbers, s.n_numbers, 0) && agree(&x[1], "variances", k, d, 0, 0)
                                && agree(&x[2], "phases", k, e, p, 0) && agree(&x[3], "aside", k, e, p, 0)
                                && agree(&x[5], "white", k, e, p, d) && agree(&x[6], "logarithms", k, e, p, d);
    if (done && n >> 24) {
        PyErr_Format(PyExc_ValueError, "residuals: expected few numbers of each account, got %zd", n);
        done = 0;
    }
    for (Py_ssize_t i = 0; done && i < k * e * p; i++)
        if (s.phases[i] < 0 || s.phases[i] >= s.n_numbers || (s.phases[i] + 1) * d > s.n_numbers) {
            PyErr_Format(PyExc_ValueError, "phases: expected points of paths of %zd numbers", s.n_numbers);
            done = 0;
        }
    if (done) {
        const Py_ssize_t size = (n + 1) * (n + 2) / 2 * WIDTH;
        double *work = malloc((size + (p + n) * WIDTH) * sizeof(double));
        s.triangle = work;
        s.pushes = work + size;
        s.numbers = (int64_t *)(s.pushes + p * WIDTH);
        done = work != NULL;
        if (done) {
            Py_BEGIN_ALLOW_THREADS
            is_positive = CHOOSE(whiten_all)(&s);
            Py_END_ALLOW_THREADS
        } else
            PyErr_NoMemory();
        free(work);
    }
    release(x, COUNT);
    return done ? PyBool_FromLong(is_positive) : NULL;
}

/* ---- Recordings --------------------------------------------------------------------------------------------------------- */

static PyObject *plain_recordings(PyObject *module, PyObject *const *arguments, Py_ssize_t given)
{
    static const Spec specs[] = {{"values", 0, 3, 0}, {"limits", 0, 1, 0}, {"is_plain", 1, 1, 1}};
    enum { COUNT = sizeof(specs) / sizeof(specs[0]) };
    Array x[COUNT];
    if (take(arguments, given, specs, COUNT, x) < 0) return NULL;
    const Recordings s = {.n = x[0].view.shape[0], .n_times = x[0].view.shape[1], .n_signals = x[0].view.shape[2],
                          .values = x[0].data, .limits = x[1].data};
    const int fits = agree(&x[1], "limits", s.n_signals, 0, 0, 0) && agree(&x[2], "is_plain", s.n, 0, 0, 0);
    if (fits) {
        Py_BEGIN_ALLOW_THREADS
        CHOOSE(look_for_odd)(&s, x[2].view.buf);
        Py_END_ALLOW_THREADS
    }
    release(x, COUNT);
    if (!fits) return NULL;
    Py_RETURN_NONE;
}

static PyObject *points_on_lines(PyObject *module, PyObject *const *arguments, Py_ssize_t given)
{
    static const Spec specs[] = {{"values", 0, 3, 0}, {"after", 0, 1, 1}, {"beyond", 0, 1, 0}, {"starts", 0, 2, 0},
                                 {"ranges", 0, 1, 0}, {"points", 1, 3, 0}};
    enum { COUNT = sizeof(specs) / sizeof(specs[0]) };
    Array x[COUNT];
    if (take(arguments, given, specs, COUNT, x) < 0) return NULL;
    const Recordings s = {
        .n = x[0].view.shape[0], .n_times = x[0].view.shape[1], .n_signals = x[0].view.shape[2], .n_points = x[1].view.shape[0],
        .values = x[0].data, .after = x[1].integers, .beyond = x[2].data, .starts = x[3].data, .ranges = x[4].data,
    };
    int fits = agree(&x[2], "beyond", s.n_points, 0, 0, 0) && agree(&x[3], "starts", s.n, s.n_signals, 0, 0)
               && agree(&x[4], "ranges", s.n_signals, 0, 0, 0) && agree(&x[5], "points", s.n_points, s.n_signals, s.n, 0);
    for (Py_ssize_t k = 0; fits && k < s.n_points; k++)
        if (s.after[k] < 0 || s.after[k] >= s.n_times) {
            PyErr_Format(PyExc_ValueError, "after: expected samples below %zd", s.n_times);
            fits = 0;
        }
    if (fits) {
        Py_BEGIN_ALLOW_THREADS
        CHOOSE(draw_lines)(&s, x[5].data);
        Py_END_ALLOW_THREADS
    }
    release(x, COUNT);
    if (!fits) return NULL;
    Py_RETURN_NONE;
}

/* ---- augmented_step ----------------------------------------------------------------------------------------------------- */

/* Room for the arrays to work in; NULL without memory. */
static double *augmented_room(Augmented *s)
{
    const Py_ssize_t q = s->n_outputs, r = s->n_latent, n = s->n_states, w = s->width, size = s->size;
    const Py_ssize_t sizes[] = {q * w, q, q, q * size, q * q, q * r, q * (r + ROWS), q * (r + WIDTH),
                                n * (1 + 2 * w + size + 3 * n) + size * size};
    double **const parts[] = {&s->looks, &s->errors, &s->white, &s->totals, &s->factor, &s->shown, &s->rows, &s->columns, &s->some};
    enum { COUNT = sizeof(sizes) / sizeof(sizes[0]) };
    Py_ssize_t total = 0;
    for (int i = 0; i < COUNT; i++) total += sizes[i];
    double *work = malloc((total + 1) * sizeof(double)), *next = work;
    for (int i = 0; work && i < COUNT; next += sizes[i++]) *parts[i] = next;
    return work;
}

/* The GIL is kept: who waits for a tick would wait for it once more. */
static PyObject *augmented_step(PyObject *module, PyObject *const *arguments, Py_ssize_t given)
{
    static const Spec specs[] = {
        {"observation", 0, 2, 0}, {"believed", 0, 2, 1}, {"path", 0, 2, 0}, {"designs", 0, 3, 0}, {"next_path", 0, 2, 0},
        {"next_designs", 0, 3, 0}, {"sensors", 0, 3, 0}, {"noise", 0, 3, 0}, {"transition", 0, 3, 0}, {"driven", 0, 3, 0},
        {"mean", 0, 1, 0}, {"covariance", 0, 2, 0}, {"offset", 0, 2, 0}, {"loading", 0, 3, 0}, {"spread", 0, 3, 0},
        {"next_mean", 1, 1, 0}, {"next_covariance", 1, 2, 0}, {"next_offset", 1, 2, 0}, {"next_loading", 1, 3, 0},
        {"next_spread", 1, 3, 0}, {"states", 1, 2, 0}, {"state_covariances", 1, 3, 0}, {"innovations", 1, 1, 0},
        {"innovation_covariance", 1, 2, 0}, {"log_likelihoods", 1, 1, 0}, {"fused", 1, 1, 1}, {"gains", 1, 2, 0},
        {"deviation_gains", 1, 3, 0},
    };
    enum { COUNT = sizeof(specs) / sizeof(specs[0]) };
    Array x[COUNT];
    if (take(arguments, given, specs, COUNT, x) < 0) return NULL;
    const Py_ssize_t g = x[3].view.shape[0], n = x[3].view.shape[1], w = x[3].view.shape[2], size = x[0].view.shape[1];
    const Py_ssize_t q = g * size, r = g * w, b = x[21].view.shape[1], n_gains = x[26].view.shape[0];
    const Py_ssize_t wanted[COUNT][4] = {
        {g, size}, {g, size}, {g, n}, {g, n, w}, {g, n}, {g, n, w}, {g, size, n}, {g, size, size}, {g, n, n}, {g, n, n},
        {r}, {r, r}, {g, n}, {g, n, w}, {g, n, n}, {r}, {r, r}, {g, n}, {g, n, w}, {g, n, n}, {g, n},
        {b > 0 ? g * n / b : 0, b, b}, {q}, {q, q}, {q}, {q}, {n_gains ? q : 0, r}, {g, n, size},
    };
    Py_ssize_t n_fused = 0;
    int done = 1;
    for (int i = 0; done && i < COUNT; i++)
        done = agree(&x[i], specs[i].name, wanted[i][0], wanted[i][1], wanted[i][2], wanted[i][3]);
    if (done && (b < 1 || n % b)) {
        PyErr_Format(PyExc_ValueError, "state_covariances: expected blocks of a part of %zd states, got %zd", n, b);
        done = 0;
    }
    Augmented s = {
        .n_groups = g, .size = size, .n_states = n, .width = w, .block = b, .n_outputs = q, .n_latent = r, .n_gains = n_gains,
        .observation = x[0].data, .believed = x[1].integers, .path = x[2].data, .designs = x[3].data, .next_path = x[4].data,
        .next_designs = x[5].data, .sensors = x[6].data, .noise = x[7].data, .transition = x[8].data, .driven = x[9].data,
        .mean = x[10].data, .covariance = x[11].data, .offset = x[12].data, .loading = x[13].data, .spread = x[14].data,
        .next_mean = x[15].data, .next_covariance = x[16].data, .next_offset = x[17].data, .next_loading = x[18].data,
        .next_spread = x[19].data, .states = x[20].data, .state_covariances = x[21].data, .innovations = x[22].data,
        .innovation_covariance = x[23].data, .log_likelihoods = x[24].data, .fused = x[25].view.buf, .gains = x[26].data,
        .deviation_gains = x[27].data,
    };
    if (done) {
        double *work = augmented_room(&s);
        done = work != NULL;
        if (!done)
            PyErr_NoMemory();
        else if (!CHOOSE(augmented_all)(&s)) {
            PyErr_SetString(PyExc_ValueError, "expected innovations with a positive definite covariance");
            done = 0;
        }
        for (Py_ssize_t o = 0; done && o < q; o++) n_fused += s.fused[o] != 0;
        free(work);
    }
    release(x, COUNT);
    return done ? PyLong_FromSsize_t(n_fused) : NULL;
}

/* ---- The module --------------------------------------------------------------------------------------------------------- */

#define FUNCTION(name) {#name, (PyCFunction)(void (*)(void))name, METH_FASTCALL, NULL}

static PyMethodDef functions[] = {
    FUNCTION(filter_systems), FUNCTION(squared_innovations), FUNCTION(smoothed_states), FUNCTION(smooth_backwards),
    FUNCTION(least_squares), FUNCTION(window_evidence), FUNCTION(window_ratios), FUNCTION(window_sums), FUNCTION(whiten),
    FUNCTION(plain_recordings), FUNCTION(points_on_lines), FUNCTION(augmented_step),
    {NULL, NULL, 0, NULL},
};

static int add_types(PyObject *module)
{
    PyObject *type = PyType_FromSpec(&step_spec);
    const int added = type == NULL ? -1 : PyModule_AddObjectRef(module, "PreparedSteps", type);
    Py_XDECREF(type);
    return added;
}

static PyModuleDef_Slot slots[] = {{Py_mod_exec, (void *)add_types}, {0, NULL}};

static struct PyModuleDef definition = {
    PyModuleDef_HEAD_INIT, "_kernels", "The loops of probdmp.gaussian, compiled; see _kernels_numpy.py.", 0, functions, slots,
    NULL, NULL, NULL,
};

PyMODINIT_FUNC PyInit__kernels(void)
{
    look_at_processor();
    return PyModuleDef_Init(&definition);
}

#else /* NAMED: the loops */

/* ---- One step of one system --------------------------------------------------------------------------------------------- */

/* m- = A m + drift,  V- = A V A^T + u b b^T, in place. */
INLINE void predict(int n, const double *a, const double *b, const double *drift, double u, double *m, double *v)
{
    double product[MOST_STATES * MOST_STATES], mean[MOST_STATES];
    for (int i = 0; i < n; i++) {
        mean[i] = drift[i];
        for (int k = 0; k < n; k++) mean[i] += a[i * n + k] * m[k];
        for (int j = 0; j < n; j++) {
            double sum = 0;
            for (int k = 0; k < n; k++) sum += a[i * n + k] * v[k * n + j];
            product[i * n + j] = sum;
        }
    }
    for (int i = 0; i < n; i++) {
        m[i] = mean[i];
        for (int j = 0; j <= i; j++) {
            double sum = u * b[i] * b[j];
            for (int k = 0; k < n; k++) sum += product[i * n + k] * a[j * n + k];
            v[i * n + j] = v[j * n + i] = sum;
        }
    }
}

/* Takes in an observation, in place; V in Joseph form. Gives the log-likelihood; 0 if there was none. */
INLINE double update(int n, const double *c, double r, double observation, double *m, double *v, double *gain,
                     double *innovation, double *variance)
{
    double spread[MOST_STATES], s = r, e = observation;
    for (int i = 0; i < n; i++) {
        spread[i] = 0;
        for (int k = 0; k < n; k++) spread[i] += v[i * n + k] * c[k];
        e -= c[i] * m[i];
    }
    for (int i = 0; i < n; i++) s += c[i] * spread[i];
    *innovation = e;
    *variance = s;
    if (isnan(e)) {
        for (int i = 0; i < n; i++) gain[i] = 0;
        return 0;
    }
    double kept[MOST_STATES * MOST_STATES], product[MOST_STATES * MOST_STATES];
    for (int i = 0; i < n; i++) {
        gain[i] = spread[i] / s;
        m[i] += gain[i] * e;
    }
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) kept[i * n + j] = (i == j) - gain[i] * c[j];
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            double sum = 0;
            for (int k = 0; k < n; k++) sum += kept[i * n + k] * v[k * n + j];
            product[i * n + j] = sum;
        }
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) {
            double sum = r * gain[i] * gain[j];
            for (int k = 0; k < n; k++) sum += product[i * n + k] * kept[j * n + k];
            v[i * n + j] = v[j * n + i] = sum;
        }
    return -0.5 * (e * e / s + log(s) + LOG_2PI);
}

INLINE void filter_system(int n, const Systems *s, Py_ssize_t i)
{
    double m[MOST_STATES], v[MOST_STATES * MOST_STATES];
    const Py_ssize_t count = s->n_systems;
    const double *a = s->a + i * n * n, *b = s->b + i * n, *c = s->c + i * n;
    memcpy(m, s->m0 + i * n, n * sizeof(double));
    memcpy(v, s->v0 + i * n * n, n * n * sizeof(double));
    for (Py_ssize_t t = 0; t < s->n_times; t++) {
        const Py_ssize_t here = t * count + i;
        if (t > 0) predict(n, a, b, s->drifts + (here - count) * n, s->u[here - count], m, v);
        s->log_likelihoods[here] = update(n, c, s->r[i], s->observed[here], m, v, s->gains + here * n, s->innovations + here,
                                          s->variances + here);
        memcpy(s->means + here * n, m, n * sizeof(double));
        memcpy(s->covariances + here * n * n, v, n * n * sizeof(double));
    }
}

static void filter_all(int n, const Systems *systems)
{
#define BODY(k) for (Py_ssize_t i = 0; i < systems->n_systems; i++) filter_system(k, systems, i)
    WITH_STATES(n, BODY)
#undef BODY
}

/* ---- Lanes -------------------------------------------------------------------------------------------------------------- */

INLINE Lane load(const double *from)
{
    Lane x;
    UNROLL for (int i = 0; i < PARTS; i++) x.part[i] = ((const Anywhere *)from)[i];
    return x;
}

INLINE void store(double *to, Lane x)
{
    UNROLL for (int i = 0; i < PARTS; i++) ((Anywhere *)to)[i] = x.part[i];
}

INLINE Lane everywhere(double number)
{
    Lane x;
    UNROLL for (int i = 0; i < PARTS; i++) x.part[i] = (Vector){0} + number;
    return x;
}

INLINE Lane times(double factor, Lane x)
{
    UNROLL for (int i = 0; i < PARTS; i++) x.part[i] = factor * x.part[i];
    return x;
}

/* sum + factor x */
INLINE Lane plus(Lane sum, double factor, Lane x)
{
    UNROLL for (int i = 0; i < PARTS; i++) sum.part[i] += factor * x.part[i];
    return sum;
}

INLINE Lane quotient(Lane x, Lane y)
{
    UNROLL for (int i = 0; i < PARTS; i++) x.part[i] /= y.part[i];
    return x;
}

/* sum + x y */
INLINE Lane plus_product(Lane sum, Lane x, Lane y)
{
    UNROLL for (int i = 0; i < PARTS; i++) sum.part[i] += x.part[i] * y.part[i];
    return sum;
}

/* sum - x y */
INLINE Lane minus_product(Lane sum, Lane x, Lane y)
{
    UNROLL for (int i = 0; i < PARTS; i++) sum.part[i] -= x.part[i] * y.part[i];
    return sum;
}

INLINE Lane root(Lane x)
{
    double numbers[WIDTH];
    store(numbers, x);
    for (int w = 0; w < WIDTH; w++) numbers[w] = sqrt(numbers[w]);
    return load(numbers);
}

INLINE Lane plus_number(Lane x, double number)
{
    UNROLL for (int i = 0; i < PARTS; i++) x.part[i] = x.part[i] + number;
    return x;
}

INLINE Lane smaller(Lane x, Lane y)
{
#ifdef MASK
    UNROLL for (int i = 0; i < PARTS; i++) {
        const MASK is_less = x.part[i] < y.part[i];
        x.part[i] = (Vector)((is_less & (MASK)x.part[i]) | (~is_less & (MASK)y.part[i]));
    }
#else
    for (int i = 0; i < PARTS; i++) x.part[i] = x.part[i] < y.part[i] ? x.part[i] : y.part[i];
#endif
    return x;
}

/* ln x of normal positive numbers, to an ulp: x = 2^k (1 + f), s = f / (2 + f), ln (1 + f) = 2 atanh s by its minimax polynomial.
   Source: e_log.c of FreeBSD's msun, (c) 1993 Sun Microsystems, free to use. Other numbers are left to the C library. */
INLINE Lane logarithm(Lane x)
{
#ifdef MASK
    MASK is_normal = {-1, -1, -1, -1};
    Lane y;
    UNROLL for (int i = 0; i < PARTS; i++) {
        const MASK bits = (MASK)x.part[i], above = ((bits & 0xfffffffffffff) > 0x6a09e667f3bcd) & 1; /* sqrt 2 */
        const MASK exponent = (bits >> 52) - 1023 + above, mantissa = (bits & 0xfffffffffffff) | ((1023 - above) << 52);
        const Vector k = (Vector)(exponent + 0x4338000000000000) - 0x1.8p52; /* as numbers: there is no instruction */
        const Vector f = (Vector)mantissa - 1.0, s = f / (2.0 + f), z = s * s, w = z * z, half = 0.5 * f * f;
        const Vector even = w * (3.999999999940941908e-01 + w * (2.222219843214978396e-01 + w * 1.531383769920937332e-01));
        const Vector odd = z * (6.666666666666735130e-01 + w * (2.857142874366239149e-01
                                + w * (1.818357216161805012e-01 + w * 1.479819860511658591e-01)));
        y.part[i] = k * 6.93147180369123816490e-01 - ((half - (s * (half + even + odd) + k * 1.90821492927058770002e-10)) - f);
        is_normal &= (bits >= 0x0010000000000000) & (bits < 0x7ff0000000000000);
    }
    if (is_normal[0] & is_normal[1] & is_normal[2] & is_normal[3]) return y;
#endif
    double numbers[WIDTH];
    store(numbers, x);
    for (int w = 0; w < WIDTH; w++) numbers[w] = log(numbers[w]);
    return load(numbers);
}

/* x, but 0 where e is NaN */
INLINE Lane where_seen(Lane x, Lane e)
{
#ifdef MASK
    UNROLL for (int i = 0; i < PARTS; i++) x.part[i] = (Vector)((MASK)x.part[i] & (e.part[i] == e.part[i]));
#else
    for (int i = 0; i < PARTS; i++) x.part[i] = isnan(e.part[i]) ? 0 : x.part[i];
#endif
    return x;
}

/* x, but -infinity where it is not above a number */
/* What is above its floor, which rises to it up to a limit, and -infinity elsewhere. */
INLINE Lane take_above(Lane x, double *floors, double limit, Py_ssize_t width)
{
    double numbers[WIDTH];
    store(numbers, x);
    for (Py_ssize_t w = 0; w < width; w++) {
        const double rise = numbers[w] < limit ? numbers[w] : limit;
        if (!(numbers[w] > floors[w])) numbers[w] = -INFINITY;
        else if (rise > floors[w]) floors[w] = rise;
    }
    return load(numbers);
}

INLINE int any_above(Lane x, Lane floor)
{
#ifdef MASK
    MASK above = x.part[0] > floor.part[0];
    UNROLL for (int i = 1; i < PARTS; i++) above |= x.part[i] > floor.part[i];
    return (above[0] | above[1] | above[2] | above[3]) != 0;
#else
    int above = 0;
    for (int i = 0; i < PARTS; i++) above |= x.part[i] > floor.part[i];
    return above;
#endif
}

/* ---- PreparedSteps ------------------------------------------------------------------------------------------------------ */

/* WIDTH degrees of freedom at once; each number of theirs is in a row of its own, `stride` long. Rows of `system` are A, b, c, r; of
   `inputs` the drift and u; of a record m and V of the next tick, then e, S and the log-likelihood of this one. */
INLINE void step_lane(int n, Py_ssize_t stride, const double *system, const double *inputs, Lane observed, const double *before,
                      double *after)
{
    Lane a[MOST_STATES * MOST_STATES], c[MOST_STATES], m[MOST_STATES], v[MOST_STATES * MOST_STATES], gain[MOST_STATES];
    Lane kept[MOST_STATES * MOST_STATES], product[MOST_STATES * MOST_STATES], spread[MOST_STATES];
    const double *b = system + n * n * stride, *drift = inputs;
    const Lane r = load(b + 2 * n * stride), zero = everywhere(0.0), u = load(inputs + n * stride);
    Lane e = observed, s = r;
    UNROLL for (int i = 0; i < n; i++) {
        m[i] = load(before + i * stride);
        c[i] = load(b + (n + i) * stride);
        UNROLL for (int j = 0; j < n; j++) {
            a[i * n + j] = load(system + (i * n + j) * stride);
            v[i * n + j] = load(before + (n + i * n + j) * stride);
        }
    }
    UNROLL for (int i = 0; i < n; i++) {
        spread[i] = zero;
        UNROLL for (int k = 0; k < n; k++) spread[i] = plus_product(spread[i], v[i * n + k], c[k]);
        e = plus_product(e, times(-1.0, c[i]), m[i]);
        s = plus_product(s, c[i], spread[i]);
    }
    const Lane seen = where_seen(e, e), nats = plus_number(plus_product(logarithm(s), e, quotient(e, s)), LOG_2PI);
    store(after + (n + n * n) * stride, e);
    store(after + (n + n * n + 1) * stride, s);
    store(after + (n + n * n + 2) * stride, where_seen(times(-0.5, nats), e));
    UNROLL for (int i = 0; i < n; i++) {
        gain[i] = where_seen(quotient(spread[i], s), e);
        m[i] = plus_product(m[i], gain[i], seen);
        UNROLL for (int j = 0; j < n; j++) kept[i * n + j] = times(-1.0, plus_product(zero, gain[i], c[j]));
        UNROLL for (int k = 0; k < PARTS; k++) kept[i * n + i].part[k] += 1.0;
    }
    UNROLL for (int i = 0; i < n; i++) /* V <- (I - K c) V (I - K c)^T + r K K^T */
        UNROLL for (int j = 0; j < n; j++) {
            product[i * n + j] = zero;
            UNROLL for (int k = 0; k < n; k++)
                product[i * n + j] = plus_product(product[i * n + j], kept[i * n + k], v[k * n + j]);
        }
    UNROLL for (int i = 0; i < n; i++)
        UNROLL for (int j = 0; j <= i; j++) {
            Lane sum = plus_product(zero, plus_product(zero, r, gain[i]), gain[j]);
            UNROLL for (int k = 0; k < n; k++) sum = plus_product(sum, product[i * n + k], kept[j * n + k]);
            v[i * n + j] = v[j * n + i] = sum;
        }
    UNROLL for (int i = 0; i < n; i++) { /* m <- A m + drift,  V <- A V A^T + u b b^T */
        Lane mean = load(drift + i * stride);
        UNROLL for (int k = 0; k < n; k++) mean = plus_product(mean, a[i * n + k], m[k]);
        store(after + i * stride, mean);
        UNROLL for (int j = 0; j < n; j++) {
            product[i * n + j] = zero;
            UNROLL for (int k = 0; k < n; k++)
                product[i * n + j] = plus_product(product[i * n + j], a[i * n + k], v[k * n + j]);
        }
    }
    UNROLL for (int i = 0; i < n; i++)
        UNROLL for (int j = 0; j <= i; j++) {
            Lane sum = plus_product(zero, plus_product(zero, u, load(b + i * stride)), load(b + j * stride));
            UNROLL for (int k = 0; k < n; k++) sum = plus_product(sum, product[i * n + k], a[j * n + k]);
            store(after + (n + i * n + j) * stride, sum);
            store(after + (n + j * n + i) * stride, sum);
        }
}

/* How many were observed; -1 if one cannot be squared. The rows are padded to a multiple of WIDTH. */
static Py_ssize_t step_all(int n, Py_ssize_t n_dof, Py_ssize_t stride, const double *system, const double *inputs,
                           const double *observed, const double *before, double *after, double *log_likelihood)
{
    const double *shares = after + (n + n * n + 2) * stride;
    Py_ssize_t n_seen = 0;
    for (Py_ssize_t d = 0; d < n_dof; d++) {
        if (fabs(observed[d]) > LARGEST_MAGNITUDE) return -1;
        n_seen += !isnan(observed[d]);
    }
    for (Py_ssize_t d = 0; d < stride; d += WIDTH) {
        double padded[WIDTH] = {0};
        if (d + WIDTH > n_dof) memcpy(padded, observed + d, (n_dof - d) * sizeof(double));
        const Lane o = load(d + WIDTH > n_dof ? padded : observed + d);
#define BODY(k) step_lane(k, stride, system + d, inputs + d, o, before + d, after + d)
        WITH_STATES(n, BODY)
#undef BODY
    }
    for (Py_ssize_t d = 0; d < n_dof; d++) *log_likelihood += shares[d];
    return n_seen;
}

/* ---- Series that share their gains -------------------------------------------------------------------------------------- */

#ifdef SHUFFLE
/* Rows become columns, in place. */
INLINE void transpose(Vector x[4])
{
    const Vector a = SHUFFLE(x[0], x[1], 0, 4, 2, 6), b = SHUFFLE(x[0], x[1], 1, 5, 3, 7);
    const Vector c = SHUFFLE(x[2], x[3], 0, 4, 2, 6), d = SHUFFLE(x[2], x[3], 1, 5, 3, 7);
    x[0] = SHUFFLE(a, c, 0, 1, 4, 5);
    x[1] = SHUFFLE(b, d, 0, 1, 4, 5);
    x[2] = SHUFFLE(a, c, 2, 3, 6, 7);
    x[3] = SHUFFLE(b, d, 2, 3, 6, 7);
}
#endif

/* Observations less their path, `steps` times of WIDTH series from `first` on, side by side: tile[(t, d)][series]. */
INLINE void bring_together(const Series *s, Py_ssize_t first, Py_ssize_t start, Py_ssize_t steps, double *tile)
{
    const Py_ssize_t size = s->n_times * s->n_dof, offset = start * s->n_dof, length = steps * s->n_dof;
    const double *o[WIDTH], *path[WIDTH];
    for (int w = 0; w < WIDTH; w++) {
        const Py_ssize_t series = first + w < s->n_series ? first + w : s->n_series - 1;
        o[w] = s->observed + series * size + offset;
        path[w] = s->paths + (s->n_paths > 1 ? series : 0) * size + offset;
    }
    Py_ssize_t i = 0;
#ifdef SHUFFLE
    for (; i + 4 <= length; i += 4)
        for (int w = 0; w < WIDTH; w += 4) {
            Vector x[4];
            UNROLL for (int k = 0; k < 4; k++) x[k] = *(const Anywhere *)(o[w + k] + i) - *(const Anywhere *)(path[w + k] + i);
            transpose(x);
            UNROLL for (int k = 0; k < 4; k++) *(Anywhere *)(tile + (i + k) * WIDTH + w) = x[k];
        }
#endif
    for (; i < length; i++)
        for (int w = 0; w < WIDTH; w++) tile[i * WIDTH + w] = o[w][i] - path[w][i];
}

/* `length` numbers of each of WIDTH series, or of as many as are left, from side by side to rows that are `size` long. */
INLINE void take_apart(const double *together, Py_ssize_t length, Py_ssize_t size, Py_ssize_t left, double *rows)
{
    Py_ssize_t i = 0;
#ifdef SHUFFLE
    for (; i + 4 <= length && left >= WIDTH; i += 4)
        for (int w = 0; w < WIDTH; w += 4) {
            Vector x[4];
            UNROLL for (int k = 0; k < 4; k++) x[k] = *(const Anywhere *)(together + (i + k) * WIDTH + w);
            transpose(x);
            UNROLL for (int k = 0; k < 4; k++) *(Anywhere *)(rows + (w + k) * size + i) = x[k];
        }
#endif
    for (; i < length; i++)
        for (int w = 0; w < WIDTH && w < left; w++) rows[w * size + i] = together[i * WIDTH + w];
}

INLINE Lane innovation_of(int n, const double *c, Lane y, const Lane *d)
{
    UNROLL for (int i = 0; i < n; i++) y = plus(y, -c[i], d[i]);
    return y;
}

/* Each next state waits for n operations after the last ones: compilers fuse the first product here with the sum, so that the
   other, which does not wait for the state, begins it. */
INLINE void go_on(int n, const double *closed, const double *feedback, Lane y, Lane *d)
{
    Lane next[MOST_STATES];
    UNROLL for (int i = 0; i < n; i++) {
        next[i] = plus(times(closed[i * n], d[0]), feedback[i], y);
        UNROLL for (int k = 1; k < n; k++) next[i] = plus(next[i], closed[i * n + k], d[k]);
    }
    UNROLL for (int i = 0; i < n; i++) d[i] = next[i];
}

/* Goes on with the sums of one degree of freedom of WIDTH series. Meanwhile those of the series that follow, which are as many
   numbers, one after the other, are fetched from memory: their rows are too short for the processor to guess it. */
INLINE void score_tile(int n, const Series *s, Py_ssize_t dof, Py_ssize_t start, Py_ssize_t steps, const double *tile,
                       const double *following, double *state, double *sums)
{
    Lane d[MOST_STATES], sum = load(sums);
    UNROLL for (int i = 0; i < n; i++) d[i] = load(state + i * WIDTH);
    for (Py_ssize_t t = 0; t < steps; t++) {
        const Py_ssize_t here = (start + t) * s->n_dof + dof;
        const Lane y = load(tile + (t * s->n_dof + dof) * WIDTH), e = innovation_of(n, s->sensor + dof * n, y, d);
        sum = plus_product(sum, times(s->precisions[here], e), e);
        fetch(following + here * WIDTH);
        go_on(n, s->closed + here * n * n, s->feedback + here * n, y, d);
    }
    UNROLL for (int i = 0; i < n; i++) store(state + i * WIDTH, d[i]);
    store(sums, sum);
}

/* Sums of e^2 / S over time, (N, D); NaN where an observation is missing. */
static void score_all(int n, const Series *s, double *tile, double *state, double *squares)
{
    const Py_ssize_t d = s->n_dof, longest = longest_tile(d);
    double *sums = state + d * n * WIDTH;
    for (Py_ssize_t first = 0; first < s->n_series; first += WIDTH) {
        const double *following = s->observed + (first + WIDTH) * s->n_times * d;
        memset(state, 0, d * (n + 1) * WIDTH * sizeof(double));
        for (Py_ssize_t start = 0; start < s->n_times; start += longest) {
            const Py_ssize_t steps = s->n_times - start < longest ? s->n_times - start : longest;
            bring_together(s, first, start, steps, tile);
            for (Py_ssize_t dof = 0; dof < d; dof++) {
#define BODY(k) score_tile(k, s, dof, start, steps, tile, following, state + dof * n * WIDTH, sums + dof * WIDTH)
                WITH_STATES(n, BODY)
#undef BODY
            }
        }
        for (int w = 0; w < WIDTH && first + w < s->n_series; w++)
            for (Py_ssize_t dof = 0; dof < d; dof++) squares[(first + w) * d + dof] = sums[dof * WIDTH + w];
    }
}

/* Some times of one degree of freedom of WIDTH series: d and e of each are kept. */
INLINE void filter_tile(int n, const Series *s, Py_ssize_t dof, Py_ssize_t start, Py_ssize_t steps, const double *tile,
                        const double *following, double *state, double *kept)
{
    Lane d[MOST_STATES];
    UNROLL for (int i = 0; i < n; i++) d[i] = load(state + i * WIDTH);
    for (Py_ssize_t t = 0; t < steps; t++) {
        const Py_ssize_t here = (start + t) * s->n_dof + dof;
        double *own = kept + here * (n + 1) * WIDTH;
        const Lane y = load(tile + (t * s->n_dof + dof) * WIDTH);
        UNROLL for (int i = 0; i < n; i++) store(own + i * WIDTH, d[i]);
        store(own + n * WIDTH, innovation_of(n, s->sensor + dof * n, y, d));
        fetch(following + here * WIDTH);
        go_on(n, s->closed + here * n * n, s->feedback + here * n, y, d);
    }
    UNROLL for (int i = 0; i < n; i++) store(state + i * WIDTH, d[i]);
}

/* Back through the same times:  rho[t] = c e / S + F[t]^T rho[t+1],  smoothed = path + d[t] + P[t] rho[t] */
INLINE void smooth_tile(int n, const Series *s, const double *predicted, const double *states, Py_ssize_t dof, Py_ssize_t start,
                        Py_ssize_t steps, const double *kept, double *state, double *together)
{
    Lane rho[MOST_STATES], back[MOST_STATES];
    const double *c = s->sensor + dof * n;
    UNROLL for (int i = 0; i < n; i++) rho[i] = load(state + i * WIDTH);
    for (Py_ssize_t t = steps - 1; t >= 0; t--) {
        const Py_ssize_t here = (start + t) * s->n_dof + dof;
        const double *own = kept + here * (n + 1) * WIDTH, *closed = s->closed + here * n * n;
        const Lane weighted = times(s->precisions[here], load(own + n * WIDTH));
        UNROLL for (int i = 0; i < n; i++) {
            back[i] = plus(times(closed[i], rho[0]), c[i], weighted);
            UNROLL for (int k = 1; k < n; k++) back[i] = plus(back[i], closed[k * n + i], rho[k]);
        }
        UNROLL for (int i = 0; i < n; i++) rho[i] = back[i];
        UNROLL for (int i = 0; i < n; i++) {
            Lane value = load(own + i * WIDTH);
            UNROLL for (int k = 0; k < n; k++) value = plus(value, predicted[(here * n + i) * n + k], rho[k]);
            store(together + ((t * s->n_dof + dof) * n + i) * WIDTH, plus_number(value, states[here * n + i]));
        }
    }
    UNROLL for (int i = 0; i < n; i++) store(state + i * WIDTH, rho[i]);
}

static void smooth_all(int n, const Series *s, const double *predicted, const double *states, double *work, double *smoothed)
{
    const Py_ssize_t d = s->n_dof, size = s->n_times * d, longest = longest_tile(d);
    double *tile = work, *together = tile + longest * d * WIDTH, *state = together + longest * d * n * WIDTH;
    double *kept = state + d * n * WIDTH;
    for (Py_ssize_t first = 0; first < s->n_series; first += WIDTH) {
        const double *following = s->observed + (first + WIDTH) * size;
        Py_ssize_t start = 0, steps = 0;
        memset(state, 0, d * n * WIDTH * sizeof(double));
        for (; start < s->n_times; start += steps) {
            steps = s->n_times - start < longest ? s->n_times - start : longest;
            bring_together(s, first, start, steps, tile);
            for (Py_ssize_t dof = 0; dof < d; dof++) {
#define BODY(k) filter_tile(k, s, dof, start, steps, tile, following, state + dof * n * WIDTH, kept)
                WITH_STATES(n, BODY)
#undef BODY
            }
        }
        memset(state, 0, d * n * WIDTH * sizeof(double));
        for (; start > 0; steps = longest) {
            start -= steps;
            for (Py_ssize_t dof = 0; dof < d; dof++) {
#define BODY(k) smooth_tile(k, s, predicted, states, dof, start, steps, kept, state + dof * n * WIDTH, together)
                WITH_STATES(n, BODY)
#undef BODY
            }
            take_apart(together, steps * d * n, size * n, s->n_series - first, smoothed + (first * size + start * d) * n);
        }
    }
}

/* ---- smooth_backwards --------------------------------------------------------------------------------------------------- */

/* X Y, or X^T Y */
INLINE void product(int n, int is_transposed, const double *x, const double *y, double *xy)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            double sum = 0;
            for (int k = 0; k < n; k++) sum += (is_transposed ? x[k * n + i] : x[i * n + k]) * y[k * n + j];
            xy[i * n + j] = sum;
        }
}

/* One system, from its last time on: l = A^T (score + kept^T l), L = A^T (information + kept^T L kept) A. */
INLINE void smooth_system(int n, const Filtered *s, Py_ssize_t i)
{
    double l[MOST_STATES] = {0}, information[MOST_STATES * MOST_STATES] = {0};
    double told[MOST_STATES], some[MOST_STATES * MOST_STATES], other[MOST_STATES * MOST_STATES];
    const double *a = s->a + i * n * n;
    for (Py_ssize_t t = s->n_times - 1; t >= 0; t--) {
        const Py_ssize_t here = t * s->n_systems + i;
        const double *v = s->covariances + here * n * n, *m = s->means + here * n;
        double *covariance = s->smoothed_covariances + here * n * n, *mean = s->smoothed_means + here * n;
        product(n, 0, v, information, some);
        product(n, 0, some, v, other);
        for (int j = 0; j < n; j++) {
            mean[j] = m[j];
            for (int k = 0; k < n; k++) {
                mean[j] += v[j * n + k] * l[k];
                covariance[j * n + k] = v[j * n + k] - (other[j * n + k] + other[k * n + j]) / 2;
            }
        }
        const double *kept = s->retentions + here * n * n, *shown = s->informations + here * n * n;
        product(n, 1, kept, information, some);
        product(n, 0, some, kept, other);
        for (int j = 0; j < n * n; j++) other[j] += shown[j];
        product(n, 1, a, other, some);
        product(n, 0, some, a, information);
        for (int j = 0; j < n; j++) {
            told[j] = s->scores[here * n + j];
            for (int k = 0; k < n; k++) told[j] += kept[k * n + j] * l[k];
        }
        for (int j = 0; j < n; j++) {
            l[j] = 0;
            for (int k = 0; k < n; k++) l[j] += a[k * n + j] * told[k];
        }
    }
}

static void smooth_each(int n, const Filtered *filtered)
{
#define BODY(k) for (Py_ssize_t i = 0; i < filtered->n_systems; i++) smooth_system(k, filtered, i)
    WITH_STATES(n, BODY)
#undef BODY
}

/* ---- Windows ------------------------------------------------------------------------------------------------------------ */

INLINE Py_ssize_t mapped_at(const Windows *s, Py_ssize_t place) { return place < s->n_mapped ? place : s->n_mapped - 1; }

/* Rows of the maps of some accounts of a place in the order in which they are multiplied: those that each sum adds, by output and
   account, OUTPUTS at a time, column by column as far as they reach. They stay in the cache for all executions. */
INLINE void pack(const Windows *s, const int64_t *which, Py_ssize_t a, double *to, int64_t *extent)
{
    const Py_ssize_t k = s->n_inputs;
    Py_ssize_t begin = 0;
    for (Py_ssize_t j = 0; j < s->n_sums; j++) {
        const Py_ssize_t end = s->ends[j] * a;
        for (Py_ssize_t i = begin; i < end; i += OUTPUTS) {
            const Py_ssize_t last = i + OUTPUTS < end ? i + OUTPUTS - 1 : end - 1, used = s->reach[last / a];
            for (int o = 0; o < OUTPUTS; o++) {
                const Py_ssize_t at = i + o < end ? i + o : i;
                const double *row = s->maps + (which[at % a] * s->n_outputs + at / a) * k;
                for (Py_ssize_t c = 0; c < used; c++) to[c * OUTPUTS + o] = i + o < end ? row[c] : 0;
            }
            to += used * OUTPUTS;
            *extent++ = used;
        }
        begin = end;
    }
}

/* Adds the squares of some groups of outputs of a window to the sums of as many accounts. */
INLINE const double *square_outputs(const Windows *s, const double *packed, const int64_t *extents, Py_ssize_t n_groups,
                                    Py_ssize_t n_accounts, double *sums)
{
    Py_ssize_t account = 0;
    for (Py_ssize_t g = 0; g < n_groups; g++) {
        const Lane zero = everywhere(0.0);
        Lane sum[OUTPUTS] = {zero, zero, zero, zero};
        for (Py_ssize_t c = 0; c < extents[g]; c++, packed += OUTPUTS) {
            const Lane x = load(s->window + c * WIDTH);
            UNROLL for (int o = 0; o < OUTPUTS; o++) sum[o] = plus(sum[o], packed[o], x);
        }
        UNROLL for (int o = 0; o < OUTPUTS; o++) {
            double *of = sums + account * WIDTH;
            store(of, plus_product(load(of), sum[o], sum[o]));
            account = account + 1 < n_accounts ? account + 1 : 0;
        }
    }
    return packed;
}

/* The same of the outputs up to the next end, of all accounts or of one. */
INLINE const double *square_next(const Windows *s, Py_ssize_t j, const double *packed, const int64_t **extents,
                                 Py_ssize_t n_accounts, double *sums)
{
    const Py_ssize_t n_groups = ((s->ends[j] - (j ? s->ends[j - 1] : 0)) * n_accounts + OUTPUTS - 1) / OUTPUTS;
    const int64_t *own = *extents;
    *extents += n_groups;
    return square_outputs(s, packed, own, n_groups, n_accounts, sums);
}

/* ln sum_a (scale_a (1 + square_a / freedom))^-(n_halves / 2); powers by squaring. */
INLINE Lane mix_lane(const Windows *s, const double *scales, Py_ssize_t n_halves)
{
    const Lane zero = everywhere(0.0), one = everywhere(1.0);
    Lane least = plus_number(zero, INFINITY), total = zero;
    for (Py_ssize_t a = 0; a < s->n_accounts; a++)
        least = smaller(plus_number(times(scales[a] * s->inverse, load(s->sums + a * WIDTH)), scales[a]), least);
    for (Py_ssize_t a = 0; a < s->n_accounts; a++) {
        const Lane own = plus_number(times(scales[a] * s->inverse, load(s->sums + a * WIDTH)), scales[a]);
        Lane base = quotient(least, own), power = one;
        if (n_halves % 2) power = root(base);
        for (Py_ssize_t e = n_halves / 2; e; e /= 2) {
            if (e % 2) power = plus_product(zero, power, base);
            base = plus_product(zero, base, base);
        }
        total = plus_product(total, one, power);
    }
    return plus(logarithm(total), -n_halves / 2.0, logarithm(least));
}

INLINE Lane least_lane(const Windows *s)
{
    Lane least = plus_number(load(s->sums), s->penalties[0]);
    for (Py_ssize_t a = 1; a < s->n_accounts; a++)
        least = smaller(plus_number(load(s->sums + a * WIDTH), s->penalties[a]), least);
    return least;
}

/* ln (scale (1 + square / freedom))^-(n_halves / 2): of one account. */
INLINE Lane log_density(const Windows *s, double scale, Lane square, Py_ssize_t n_halves)
{
    return times(-n_halves / 2.0, logarithm(plus_number(times(scale * s->inverse, square), scale)));
}

/* WIDTH numbers, or fewer and zeros. */
INLINE Lane some_of(const double *from, Py_ssize_t width)
{
    double some[WIDTH];
    if (width == WIDTH) return load(from);
    for (int w = 0; w < WIDTH; w++) some[w] = w < width ? from[w] : 0;
    return load(some);
}

/* The windows of some executions at a place. */
INLINE void gather(const Windows *s, Py_ssize_t place, Py_ssize_t first, Py_ssize_t width)
{
    const int64_t *rows = s->rows + place * s->n_inputs;
    for (Py_ssize_t k = 0; k < s->n_inputs; k++)
        store(s->window + k * WIDTH, some_of(s->values + rows[k] * s->n + first, width));
}

INLINE void put(double *to, Lane answer, Py_ssize_t width)
{
    double some[WIDTH];
    if (width == WIDTH) {
        store(to, answer);
        return;
    }
    store(some, answer);
    memcpy(to, some, width * sizeof(double));
}

/* The least squares at one place of some executions, up to each end: arrays (wanted, n), one after the other. */
INLINE void look_at_lane(const Windows *s, Py_ssize_t place, Py_ssize_t first, Py_ssize_t width, double *found)
{
    const Py_ssize_t a = s->n_accounts, n = s->n;
    const double *packed = s->packed;
    const int64_t *extents = s->extents;
    gather(s, place, first, width);
    memset(s->sums, 0, a * WIDTH * sizeof(double));
    for (Py_ssize_t j = 0; j < s->n_sums && place < s->wanted[j]; j++) {
        packed = square_next(s, j, packed, &extents, a, s->sums);
        put(found + place * n + first, least_lane(s), width);
        found += s->wanted[j] * n;
    }
}

/* ln of the density of all that follows a place up to an end if it is where the place is; `totals` of each degree of freedom and
   `square` are those up to the end before. */
INLINE Lane at_rest(const Windows *s, const Contrary *c, Py_ssize_t j, double *totals, Lane *square)
{
    const Py_ssize_t d = c->n_dof, first = s->n_inputs - s->n_outputs, n_points = (s->ends[j] - s->ends[BEFORE]) / d;
    const double *place = s->window + (first + s->ends[BEFORE] - d) * WIDTH;
    for (Py_ssize_t i = first + s->ends[j - 1]; i < first + s->ends[j]; i += d)
        for (Py_ssize_t k = 0; k < d; k++) {
            const Lane moved = times(1 / c->stds[k], plus(load(s->window + (i + k) * WIDTH), -1.0, load(place + k * WIDTH)));
            store(totals + k * WIDTH, plus(load(totals + k * WIDTH), 1.0, moved));
            *square = plus_product(*square, moved, moved);
        }
    Lane distance = *square;
    for (Py_ssize_t k = 0; k < d; k++)
        distance = plus_product(distance, times(-1.0 / (n_points + 1), load(totals + k * WIDTH)), load(totals + k * WIDTH));
    return plus_number(times(-0.5, distance), c->constants[j - AHEAD]);
}

/* The last of the sums before an end of which, with what came before, there may be more than a floor; BEFORE if there is none. */
INLINE Py_ssize_t last_above(const Lane before, const double *most, const double *floors, Py_ssize_t n, Py_ssize_t width,
                             Py_ssize_t end)
{
    while (--end > BEFORE)
        if (any_above(plus(before, 1.0, load(most + end * WIDTH)), some_of(floors + (end - AHEAD) * n, width))) break;
    return end;
}

/* Evidence for rest at one place of some executions, where it is above its floor. What all accounts say of it is at least what one
   of them says, and of what came before at most `before`, or what its beginning lets them say, so most of them need not be asked:
   at most places there is none. */
INLINE void weigh_rest(const Windows *s, const Contrary *c, Lane before, Py_ssize_t place, Py_ssize_t first, Py_ssize_t width,
                       double *found)
{
    const Py_ssize_t a = s->n_accounts, n = s->n, mapped = mapped_at(s, place);
    const double *scales = s->scales + mapped * s->n_sums * a, *packed = s->own;
    const int64_t *extents = s->own_extents;
    double *totals = s->more, *others = totals + c->n_dof * WIDTH, *most = others + s->n_sums * WIDTH, own[WIDTH] = {0};
    double *floors = c->floors + first, *central = s->sums + s->central * WIDTH;
    const Lane zero = everywhere(0.0), nothing = everywhere(-INFINITY);
    Lane square = zero;
    Py_ssize_t n_ends = AHEAD;
    gather(s, place, first, width);
    memset(totals, 0, c->n_dof * WIDTH * sizeof(double));
    for (Py_ssize_t j = 0; j < AHEAD; j++) packed = square_next(s, j, packed, &extents, 1, own);
    const Lane here = load(own);
    for (; n_ends < s->n_sums && place < s->wanted[n_ends]; n_ends++) {
        const Lane other = at_rest(s, c, n_ends, totals, &square);
        packed = square_next(s, n_ends, packed, &extents, 1, own);
        const Lane least = log_density(s, scales[n_ends * a + s->central], load(own), s->n_halves[n_ends]);
        store(others + n_ends * WIDTH, other);
        store(most + n_ends * WIDTH, plus(other, -1.0, least));
    }
    Py_ssize_t last = last_above(before, most, floors, n, width, n_ends);
    packed = s->packed;
    extents = s->extents;
    memset(s->sums, 0, a * WIDTH * sizeof(double));
    for (Py_ssize_t j = 0; j < AHEAD && last > BEFORE; j++) {
        packed = square_next(s, j, packed, &extents, a, s->sums);
        const Lane begun = load(central);
        store(central, here);
        before = mix_lane(s, scales + BEFORE * a, s->n_halves[BEFORE]);
        store(central, begun);
        last = last_above(before, most, floors, n, width, last + 1);
    }
    double *to = found + place * n + first;
    for (Py_ssize_t j = AHEAD; j < n_ends; to += s->wanted[j++] * n) {
        Lane answer = nothing;
        if (j <= last) {
            packed = square_next(s, j, packed, &extents, a, s->sums);
            const Lane evidence = plus(plus(load(others + j * WIDTH), 1.0, before), -1.0, mix_lane(s, scales + j * a, s->n_halves[j]));
            answer = take_above(evidence, floors + (j - AHEAD) * n, c->limits[j - AHEAD], width);
        }
        put(to, answer, width);
    }
}

/* ln of the mixture of other windows over that of these, at one place of some executions, where it is above its floor. The central
   account of these, and the beginning of the others, say how large it is at most. */
INLINE void weigh_windows(const Windows *s, const Contrary *c, Py_ssize_t place, Py_ssize_t first, Py_ssize_t width, double *found)
{
    const Windows *other = c->windows;
    const Py_ssize_t a = s->n_accounts, b = other->n_accounts, last = s->n_sums - 1, n_halves = s->n_halves[last];
    const double *scales = s->scales + (mapped_at(s, place) * s->n_sums + last) * a;
    const double *other_scales = other->scales + (mapped_at(other, place) * s->n_sums + last) * b;
    const Lane floor = some_of(c->floors + first, width);
    const double *packed = s->own;
    const int64_t *extents = s->own_extents;
    double own[WIDTH] = {0};
    gather(s, place, first, width);
    for (Py_ssize_t j = 0; j <= last; j++) packed = square_next(s, j, packed, &extents, 1, own);
    const Lane least = log_density(s, scales[s->central], load(own), n_halves);
    Lane most = least;
    packed = other->packed;
    extents = other->extents;
    memset(other->sums, 0, b * WIDTH * sizeof(double));
    for (Py_ssize_t j = 0; j <= last; j++) {
        packed = square_next(other, j, packed, &extents, b, other->sums);
        most = mix_lane(other, other_scales, n_halves);
        if (!any_above(plus(most, -1.0, least), floor)) {
            put(found + place * s->n + first, everywhere(-INFINITY), width);
            return;
        }
    }
    packed = s->packed;
    extents = s->extents;
    memset(s->sums, 0, a * WIDTH * sizeof(double));
    for (Py_ssize_t j = 0; j <= last; j++) packed = square_next(s, j, packed, &extents, a, s->sums);
    const Lane ratio = plus(most, -1.0, mix_lane(s, scales, n_halves));
    put(found + place * s->n + first, take_above(ratio, c->floors + first, c->limits[0], width), width);
}

/* The maps of all accounts of a place, and if they are asked for those of the central one alone. */
INLINE void pack_place(const Windows *s, Py_ssize_t place, int has_own)
{
    const int64_t *which = s->which + mapped_at(s, place) * s->n_accounts;
    pack(s, which, s->n_accounts, s->packed, s->extents);
    if (has_own) pack(s, which + s->central, 1, s->own, s->own_extents);
}

static void look_at_windows(const Windows *s, double *found)
{
    for (Py_ssize_t place = 0; place < s->wanted[0]; place++) {
        pack_place(s, place, 0);
        for (Py_ssize_t first = 0; first < s->n; first += WIDTH)
            look_at_lane(s, place, first, s->n - first < WIDTH ? s->n - first : WIDTH, found);
    }
}

static void weigh_all(const Windows *s, const Contrary *c, double *found)
{
    const Py_ssize_t n_places = s->wanted[c->windows ? s->n_sums - 1 : 0];
    for (Py_ssize_t place = 0; place < n_places; place++) {
        pack_place(s, place, 1);
        if (c->windows) pack_place(c->windows, place, 0);
        memset(s->sums, 0, s->n_accounts * WIDTH * sizeof(double));
        /* Of what came before a place, were it all as expected. */
        const double *scales = s->scales + mapped_at(s, place) * s->n_sums * s->n_accounts;
        const Lane most = c->windows ? everywhere(INFINITY) : mix_lane(s, scales + BEFORE * s->n_accounts, s->n_halves[BEFORE]);
        for (Py_ssize_t first = 0; first < s->n; first += WIDTH) {
            const Py_ssize_t width = s->n - first < WIDTH ? s->n - first : WIDTH;
            if (c->windows)
                weigh_windows(s, c, place, first, width, found);
            else
                weigh_rest(s, c, most, place, first, width, found);
        }
    }
}

/* ---- One window --------------------------------------------------------------------------------------------------------- */

INLINE double sum_of(Lane x)
{
#ifdef MASK
    const Vector both = x.part[0] + x.part[1];
    return (both[0] + both[2]) + (both[1] + both[3]);
#else
    return (x.part[0] + x.part[2]) + (x.part[1] + x.part[3]);
#endif
}

INLINE double dot(const double *x, const double *y, Py_ssize_t n)
{
    Lane sums = everywhere(0.0);
    Py_ssize_t i = 0;
    for (; i + WIDTH <= n; i += WIDTH) sums = plus_product(sums, load(x + i), load(y + i));
    double total = sum_of(sums);
    for (; i < n; i++) total += x[i] * y[i];
    return total;
}

/* Sums (J, A) of the squares of the outputs from each end to the next; each depends on as many inputs as it reaches. */
static void square_window(const OneWindow *s, double *sums)
{
    for (Py_ssize_t a = 0; a < s->n_accounts; a++) {
        const double *map = s->maps + s->which[a] * s->n_outputs * s->n_inputs;
        for (Py_ssize_t j = 0; j < s->n_sums; j++) {
            double sum = 0;
            for (Py_ssize_t i = s->ends[j]; i < s->ends[j + 1]; i++) {
                const double output = dot(map + i * s->n_inputs, s->window, s->reach[i]);
                sum += output * output;
            }
            sums[j * s->n_accounts + a] = sum;
        }
    }
}

/* ---- Points of paths ---------------------------------------------------------------------------------------------------- */

/* Where a row of the lower triangles of WIDTH matrices begins. */
#define ROW(triangle, i) ((triangle) + (i) * ((i) + 1) / 2 * WIDTH)

/* What WIDTH accounts from one on say, side by side: the lower triangles of the covariances, one more row below for the residuals. */
INLINE void gather_points(const Points *s, Py_ssize_t first, Py_ssize_t count)
{
    const Py_ssize_t d = s->n_dof, p = s->n_points, n = p * d;
    const double *covariance[WIDTH], *variances[WIDTH], *row[WIDTH];
    for (int w = 0; w < WIDTH; w++) {
        const Py_ssize_t account = first + w < count ? first + w : first, path = account / s->n_accounts;
        covariance[w] = s->covariances + path * s->n_numbers * s->n_numbers;
        variances[w] = s->variances + path * d;
        for (Py_ssize_t i = 0; i < n; i++) {
            s->numbers[i * WIDTH + w] = s->phases[account * p + i / d] * d + i % d;
            ROW(s->triangle, n)[i * WIDTH + w] = s->residuals[account * n + i];
        }
        for (Py_ssize_t i = 0; i < p; i++) s->pushes[i * WIDTH + w] = s->aside[account * p + i];
    }
    for (Py_ssize_t i = 0; i < n; i++) {
        double *to = ROW(s->triangle, i);
        for (int w = 0; w < WIDTH; w++) row[w] = covariance[w] + s->numbers[i * WIDTH + w] * s->n_numbers;
        for (Py_ssize_t j = 0; j <= i; j++)
            for (int w = 0; w < WIDTH; w++) to[j * WIDTH + w] = row[w][s->numbers[j * WIDTH + w]];
        for (int w = 0; w < WIDTH; w++) to[i * WIDTH + w] += variances[w][i % d];
    }
}

/* Each degree of freedom is pushed by itself. */
INLINE void push_aside(const Points *s)
{
    const Py_ssize_t d = s->n_dof;
    for (Py_ssize_t i = 0; i < s->n_points * d; i++) {
        const Lane own = load(s->pushes + i / d * WIDTH);
        for (Py_ssize_t q = 0; q <= i / d; q++) {
            double *both = ROW(s->triangle, i) + (q * d + i % d) * WIDTH;
            store(both, plus_product(load(both), own, load(s->pushes + q * WIDTH)));
        }
    }
}

/* What was not seen is given a variance of its own and a residual of zero, which says nothing of the rest. */
INLINE void forget_unseen(Py_ssize_t n, double *triangle, int w)
{
    double *residuals = ROW(triangle, n) + w;
    for (Py_ssize_t i = 0; i < n; i++) {
        if (!isnan(residuals[i * WIDTH])) continue;
        for (Py_ssize_t j = 0; j < i; j++) ROW(triangle, i)[j * WIDTH + w] = 0;
        for (Py_ssize_t j = i; j <= n; j++) ROW(triangle, j)[i * WIDTH + w] = j == i;
    }
}

/* Column j of rows of L from i >= j on, in place; of the diagonal one over it is kept. */
INLINE void solve_column(int n_rows, double *triangle, Py_ssize_t i, Py_ssize_t j)
{
    double *above = ROW(triangle, j);
    const Lane zero = everywhere(0.0);
    Lane sum[ROWS];
    UNROLL for (int r = 0; r < n_rows; r++) sum[r] = load(ROW(triangle, i + r) + j * WIDTH);
    for (Py_ssize_t k = 0; k < j; k++) {
        const Lane x = load(above + k * WIDTH);
        UNROLL for (int r = 0; r < n_rows; r++) sum[r] = minus_product(sum[r], load(ROW(triangle, i + r) + k * WIDTH), x);
    }
    if (i == j) store(above + j * WIDTH, quotient(everywhere(1.0), root(sum[0])));
    const Lane scale = load(above + j * WIDTH);
    UNROLL for (int r = i == j; r < n_rows; r++) store(ROW(triangle, i + r) + j * WIDTH, plus_product(zero, sum[r], scale));
}

INLINE void factorise_rows(int n_rows, Py_ssize_t n, double *triangle, Py_ssize_t i)
{
    for (Py_ssize_t j = 0; j < i; j++) solve_column(n_rows, triangle, i, j);
    UNROLL for (int r = 0; r < n_rows; r++)
        if (i + r < n) solve_column(n_rows - r, triangle, i + r, i + r);
}

/* L, and in row n L^-1 r, of WIDTH matrices L L^T and residuals r, in place. */
INLINE void factorise_lane(Py_ssize_t n, double *triangle)
{
    for (Py_ssize_t i = 0; i <= n; i += ROWS) {
#define BODY(n_rows) factorise_rows(n_rows, n, triangle, i)
        WITH_STATES(n + 1 - i < ROWS ? n + 1 - i : ROWS, BODY) /* of rows, too, there are 1 to 4 */
#undef BODY
    }
}

/* Whether all covariances are positive definite; else what is written is not to be used. */
static int whiten_all(const Points *s)
{
    const Py_ssize_t n = s->n_points * s->n_dof, count = n ? s->n_paths * s->n_accounts : 0;
    int is_positive = 1;
    for (Py_ssize_t first = 0; first < count; first += WIDTH) {
        gather_points(s, first, count);
        push_aside(s);
        for (int w = 0; w < WIDTH; w++) forget_unseen(n, s->triangle, w);
        factorise_lane(n, s->triangle);
        for (Py_ssize_t i = 0; i < n; i++) {
            double *white = ROW(s->triangle, n) + i * WIDTH, *diagonal = ROW(s->triangle, i) + i * WIDTH;
            store(diagonal, times(-1.0, logarithm(load(diagonal))));
            for (int w = 0; w < WIDTH && first + w < count; w++) {
                s->white[(first + w) * n + i] = white[w];
                s->logarithms[(first + w) * n + i] = diagonal[w];
                is_positive &= isfinite(diagonal[w]) != 0;
            }
        }
    }
    return is_positive;
}
#undef ROW

/* ---- Recordings --------------------------------------------------------------------------------------------------------- */

/* Which recordings have no sample that repeats the one before, or is further from the line through the two before than may be. */
static void look_for_odd(const Recordings *s, int64_t *is_plain)
{
    const Py_ssize_t d = s->n_signals, size = s->n_times * d;
    for (Py_ssize_t i = 0; i < s->n; i++) {
        const double *v = s->values + i * size;
        int odd = 0;
        for (Py_ssize_t j = d; j < size; j++) odd |= v[j] == v[j - d];
        for (Py_ssize_t k = 0; k < d; k++)
            for (Py_ssize_t j = k + 2 * d; j < size; j += d)
                odd |= !(fabs((v[j] - v[j - d]) - (v[j - d] - v[j - 2 * d])) <= s->limits[k]);
        is_plain[i] = !odd;
    }
}

/* WIDTH recordings at a time, as their points are neighbours. Rounded as NumPy does: ticks are found in either way, by execution. */
static AS_WRITTEN void draw_lines(const Recordings *s, double *points)
{
    const Py_ssize_t d = s->n_signals, size = s->n_times * d;
    for (Py_ssize_t first = 0; first < s->n; first += WIDTH) {
        const Py_ssize_t width = s->n - first < WIDTH ? s->n - first : WIDTH;
        for (Py_ssize_t k = 0; k < s->n_points; k++) {
            const Py_ssize_t after = s->after[k] * d, before = s->after[k] > 0 ? after - d : after;
            for (Py_ssize_t j = 0; j < d; j++) {
                double *to = points + (k * d + j) * s->n + first;
                const double *v = s->values + first * size + j, *start = s->starts + first * d + j;
                for (Py_ssize_t w = 0; w < width; w++, v += size) {
                    double point = (v[before] - v[after]) * s->beyond[k];
                    point += v[after];
                    to[w] = (point - start[w * d]) / s->ranges[j];
                }
            }
        }
    }
}

/* ---- What moves on top of a Gaussian that stands still ------------------------------------------------------------------ */

/* to += factor x */
INLINE void add_multiple(double *to, double factor, const double *x, Py_ssize_t n)
{
    Py_ssize_t i = 0;
    for (; i + WIDTH <= n; i += WIDTH) store(to + i, plus(load(to + i), factor, load(x + i)));
    for (; i < n; i++) to[i] += factor * x[i];
}

/* Some rows of a symmetric matrix, which are read once: to += factors rows, and what is given are the sums rows y. */
INLINE void both_ways(const double *rows, Py_ssize_t stride, Py_ssize_t n_rows, Py_ssize_t n, const double *y,
                      const double *factors, double *to, double *sums)
{
    const Lane zero = everywhere(0.0);
    Lane sum[ROWS] = {zero, zero, zero, zero};
    const double *row[ROWS];
    double factor[ROWS];
    for (int k = 0; k < ROWS; k++) { /* those that are too many are the last once more, without weight */
        row[k] = rows + (k < n_rows ? k : n_rows - 1) * stride;
        factor[k] = k < n_rows ? factors[k] : 0;
    }
    Py_ssize_t i = 0;
    for (; i + WIDTH <= n; i += WIDTH) {
        const Lane other = load(y + i);
        Lane more = load(to + i);
        UNROLL for (int k = 0; k < ROWS; k++) {
            const Lane some = load(row[k] + i);
            sum[k] = plus_product(sum[k], some, other);
            more = plus(more, factor[k], some);
        }
        store(to + i, more);
    }
    UNROLL for (int k = 0; k < ROWS; k++) sums[k] = sum_of(sum[k]);
    for (; i < n; i++)
        for (int k = 0; k < ROWS; k++) {
            sums[k] += row[k][i] * y[i];
            to[i] += factor[k] * row[k][i];
        }
}

/* product = a b, of (n, k) and (k, m). */
INLINE void multiply(Py_ssize_t n, Py_ssize_t k, Py_ssize_t m, const double *a, const double *b, double *product)
{
    memset(product, 0, n * m * sizeof(double));
    for (Py_ssize_t i = 0; i < n; i++)
        for (Py_ssize_t j = 0; j < k; j++) add_multiple(product + i * m, a[i * k + j], b + j * m, m);
}

/* product += a b^T, of (n, k) and (m, k). */
INLINE void multiply_transposed(Py_ssize_t n, Py_ssize_t k, Py_ssize_t m, const double *a, const double *b, double *product)
{
    for (Py_ssize_t i = 0; i < n; i++)
        for (Py_ssize_t j = 0; j < m; j++) product[i * m + j] += dot(a + i * k, b + j * k, k);
}

/* product = x P, for k rows x and a symmetric P of which there is the lower triangle; rows of P and of the product lie further
   apart. */
static void triangle_times(Py_ssize_t n, Py_ssize_t k, const double *p, Py_ssize_t stride, const double *x, double *product,
                           Py_ssize_t apart)
{
    for (Py_ssize_t a = 0; a < k; a++) memset(product + a * apart, 0, n * sizeof(double));
    for (Py_ssize_t i = 0; i < n; i += ROWS, p += ROWS * stride) {
        const Py_ssize_t n_rows = n - i < ROWS ? n - i : ROWS;
        for (Py_ssize_t a = 0; a < k; a++) {
            const double *factors = x + a * n + i;
            double *to = product + a * apart, sums[ROWS];
            both_ways(p, stride, n_rows, i, x + a * n, factors, to, sums);
            for (Py_ssize_t j = 0; j < n_rows; j++) {
                const double *corner = p + j * stride + i;
                to[i + j] += sums[j] + factors[j] * corner[j];
                for (Py_ssize_t l = 0; l < j; l++) {
                    to[i + j] += factors[l] * corner[l];
                    to[i + l] += factors[j] * corner[l];
                }
            }
        }
    }
}

/* A = L L^T, in place; 0 if there is no such L. */
INLINE int factorize(Py_ssize_t n, double *a)
{
    for (Py_ssize_t i = 0; i < n; i++)
        for (Py_ssize_t j = 0; j <= i; j++) {
            const double rest = a[i * n + j] - dot(a + i * n, a + j * n, j);
            if (i == j && !(rest > 0)) return 0;
            a[i * n + j] = i == j ? sqrt(rest) : rest / a[j * n + j];
        }
    return 1;
}

/* x = (L L^T)^-1 x, in place. */
INLINE void solve(Py_ssize_t n, const double *factor, double *x)
{
    for (Py_ssize_t i = 0; i < n; i++) x[i] = (x[i] - dot(factor + i * n, x, i)) / factor[i * n + i];
    for (Py_ssize_t i = n - 1; i >= 0; i--) {
        for (Py_ssize_t j = i + 1; j < n; j++) x[i] -= factor[j * n + i] * x[j];
        x[i] /= factor[i * n + i];
    }
}

/* What the outputs of a group see: of z, (size, w), of the deviation, V C^T, and how uncertain that is, C V C^T + R. */
INLINE void look_at_group(const Augmented *s, Py_ssize_t g)
{
    const Py_ssize_t n = s->n_states, w = s->width, size = s->size;
    const double *sensors = s->sensors + g * size * n, *m = s->mean + g * w;
    double *seen = s->deviation_gains + g * n * size, *total = s->totals + g * size * size;
    memset(seen, 0, n * size * sizeof(double));
    multiply_transposed(n, n, size, s->spread + g * n * n, sensors, seen);
    multiply(size, n, size, sensors, seen, total);
    add_multiple(total, 1.0, s->noise + g * size * size, size * size);
    for (Py_ssize_t a = 0; a < size; a++) {
        const Py_ssize_t o = g * size + a;
        double *look = s->looks + o * w, error = s->observation[o];
        memset(look, 0, w * sizeof(double));
        for (Py_ssize_t i = 0; i < n; i++) {
            const double c = sensors[a * n + i];
            if (c == 0) continue;
            error -= c * (s->path[g * n + i] + s->offset[g * n + i]);
            add_multiple(look, c, s->designs + (g * n + i) * w, w);
            add_multiple(look, c, s->loading + (g * n + i) * w, w);
        }
        s->errors[o] = error;
        s->innovations[o] = error - dot(look, m, w);
        s->fused[o] = s->believed[o] && !isnan(error);
    }
}

/* P G^T, one row for each output. */
INLINE void spread_looks(const Augmented *s)
{
    const Py_ssize_t w = s->width, size = s->size, r = s->n_latent;
    memset(s->shown, 0, s->n_outputs * r * sizeof(double));
    for (Py_ssize_t g = 0; g < s->n_groups; g++) {
        const double *looks = s->looks + g * size * w, *own = s->covariance + g * w * (r + 1);
        triangle_times(w, size, own, r, looks, s->shown + g * size * r + g * w, r);
        for (Py_ssize_t i = 0; i < w; i += ROWS) {
            const double *rows = s->covariance + (g * w + i) * r;
            const Py_ssize_t n_rows = w - i < ROWS ? w - i : ROWS;
            for (Py_ssize_t o = 0; o < g * size; o++) {
                const Py_ssize_t first = o / size * w, a = o % size;
                double sums[ROWS];
                both_ways(rows + first, r, n_rows, w, s->looks + o * w, looks + a * w + i,
                          s->shown + (g * size + a) * r + first, sums);
                memcpy(s->shown + o * r + g * w + i, sums, n_rows * sizeof(double));
            }
        }
    }
}

/* S of all outputs, and L of those that count; a unit for those that do not. */
INLINE int compare_outputs(const Augmented *s)
{
    const Py_ssize_t q = s->n_outputs, size = s->size, w = s->width;
    for (Py_ssize_t o = 0; o < q; o++)
        for (Py_ssize_t p = 0; p <= o; p++) {
            double value = dot(s->shown + o * s->n_latent + p / size * w, s->looks + p * w, w);
            if (o / size == p / size) value += s->totals[o * size + p % size];
            s->innovation_covariance[o * q + p] = s->innovation_covariance[p * q + o] = value;
            s->factor[o * q + p] = s->fused[o] && s->fused[p] ? value : o == p;
        }
    return factorize(q, s->factor);
}

/* W = P G^T L^-T and L^-1 e of what counts, and what is known about the mean of z; the gains W L^-1 where they are wanted. */
INLINE void whiten_tick(const Augmented *s)
{
    const Py_ssize_t q = s->n_outputs, r = s->n_latent;
    memcpy(s->next_mean, s->mean, r * sizeof(double));
    for (Py_ssize_t o = 0; o < q; o++) {
        double *row = s->shown + o * r, white = s->fused[o] ? s->innovations[o] : 0;
        const double *factor = s->factor + o * q, scale = 1 / factor[o];
        for (Py_ssize_t p = 0; p < o; p++) {
            if (factor[p] == 0) continue;
            white -= factor[p] * s->white[p];
            add_multiple(row, -factor[p], s->shown + p * r, r);
        }
        s->white[o] = white * scale;
        for (Py_ssize_t i = 0; i < r; i++) row[i] = s->fused[o] ? row[i] * scale : 0;
        add_multiple(s->next_mean, s->white[o], row, r);
    }
    for (Py_ssize_t o = s->n_gains - 1; o >= 0; o--) {
        double *gain = s->gains + o * r;
        memcpy(gain, s->shown + o * r, r * sizeof(double));
        for (Py_ssize_t p = o + 1; p < q; p++) add_multiple(gain, -s->factor[p * q + o], s->gains + p * r, r);
        for (Py_ssize_t i = 0; i < r; i++) gain[i] /= s->factor[o * q + o];
    }
}

/* As log_density_shares in density.py. */
INLINE void share_density(const Augmented *s)
{
    const Py_ssize_t q = s->n_outputs;
    double correlation = 0, n_fused = 0;
    for (Py_ssize_t o = 0; o < q; o++) {
        if (!s->fused[o]) continue;
        correlation += 2 * log(s->factor[o * q + o]) - log(s->innovation_covariance[o * q + o]);
        n_fused++;
    }
    for (Py_ssize_t o = q - 1; o >= 0; o--) { /* white becomes S^-1 e */
        for (Py_ssize_t p = o + 1; p < q; p++) s->white[o] -= s->factor[p * q + o] * s->white[p];
        s->white[o] /= s->factor[o * q + o];
        const double square = s->innovations[o] * s->white[o], variance = s->innovation_covariance[o * q + o];
        s->log_likelihoods[o] = s->fused[o] ? -0.5 * (square + LOG_2PI + log(variance) + correlation / n_fused) : 0;
    }
}

/* P - W W^T: the lower triangle, in tiles of ROWS and a lane, for which the outputs that count are brought together. */
INLINE void know_more(const Augmented *s)
{
    const Py_ssize_t r = s->n_latent;
    Py_ssize_t n = 0, q = 0;
    for (Py_ssize_t o = 0; o < s->n_outputs; o++) q += s->fused[o] != 0;
    for (Py_ssize_t o = 0; o < s->n_outputs; o++) {
        const double *row = s->shown + o * r;
        if (!s->fused[o]) continue;
        for (Py_ssize_t i = 0; i < r || i % ROWS; i++) s->rows[(i / ROWS * q + n) * ROWS + i % ROWS] = i < r ? row[i] : 0;
        for (Py_ssize_t i = 0; i < r || i % WIDTH; i++) s->columns[(i / WIDTH * q + n) * WIDTH + i % WIDTH] = i < r ? row[i] : 0;
        n++;
    }
    for (Py_ssize_t i = 0; i < r; i += ROWS) {
        const Py_ssize_t n_rows = r - i < ROWS ? r - i : ROWS;
        for (Py_ssize_t j = 0; j < i + n_rows; j += WIDTH) {
            const double *row = s->rows + i * q, *column = s->columns + j * q;
            const Lane zero = everywhere(0.0);
            Lane sum[ROWS] = {zero, zero, zero, zero};
            for (Py_ssize_t o = 0; o < q; o++, row += ROWS, column += WIDTH) {
                const Lane some = load(column);
                UNROLL for (int k = 0; k < ROWS; k++) sum[k] = plus(sum[k], row[k], some);
            }
            const double *from = s->covariance + i * r + j;
            double *to = s->next_covariance + i * r + j, parts[ROWS][WIDTH];
            if (i + ROWS <= r && j + WIDTH <= r) {
                UNROLL for (int k = 0; k < ROWS; k++) store(to + k * r, plus(load(from + k * r), -1.0, sum[k]));
                continue;
            }
            UNROLL for (int k = 0; k < ROWS; k++) store(parts[k], sum[k]);
            for (Py_ssize_t k = 0; k < n_rows; k++)
                for (Py_ssize_t w = 0; w < WIDTH && j + w < r; w++) to[k * r + w] = from[k * r + w] - parts[k][w];
        }
    }
}

/* K from V C^T, in place, of what counts; the deviation given z after the observation, and one step ahead. */
INLINE int move_group(const Augmented *s, Py_ssize_t g)
{
    const Py_ssize_t n = s->n_states, w = s->width, size = s->size;
    const double *sensors = s->sensors + g * size * n, *transition = s->transition + g * n * n;
    double *gains = s->deviation_gains + g * n * size, *offset = s->some, *loading = offset + n, *noisy = loading + n * w;
    double *kept = noisy + n * size, *spread = kept + n * n, *product = spread + n * n, *known = product + n * n;
    const int64_t *fused = s->fused + g * size;
    for (Py_ssize_t a = 0; a < size; a++)
        for (Py_ssize_t b = 0; b < size; b++)
            known[a * size + b] = fused[a] && fused[b] ? s->totals[(g * size + a) * size + b] : a == b;
    if (!factorize(size, known)) return 0;
    for (Py_ssize_t i = 0; i < n; i++) {
        for (Py_ssize_t a = 0; a < size; a++) gains[i * size + a] *= fused[a] != 0;
        solve(size, known, gains + i * size);
    }
    memcpy(offset, s->offset + g * n, n * sizeof(double));
    memcpy(loading, s->loading + g * n * w, n * w * sizeof(double));
    memset(kept, 0, n * n * sizeof(double));
    for (Py_ssize_t i = 0; i < n; i++) {
        kept[i * n + i] = 1;
        for (Py_ssize_t a = 0; a < size; a++) {
            if (!fused[a]) continue;
            const double gain = gains[i * size + a];
            offset[i] += gain * s->errors[g * size + a];
            add_multiple(loading + i * w, -gain, s->looks + (g * size + a) * w, w);
            add_multiple(kept + i * n, -gain, sensors + a * n, n);
        }
    }
    multiply(n, n, n, kept, s->spread + g * n * n, product);
    memset(spread, 0, n * n * sizeof(double));
    multiply_transposed(n, n, n, product, kept, spread);
    multiply(n, size, size, gains, s->noise + g * size * size, noisy);
    multiply_transposed(n, size, n, noisy, gains, spread);
    multiply(n, n, 1, transition, offset, s->next_offset + g * n);
    multiply(n, n, w, transition, loading, s->next_loading + g * n * w);
    multiply(n, n, n, transition, spread, product);
    memcpy(s->next_spread + g * n * n, s->driven + g * n * n, n * n * sizeof(double));
    multiply_transposed(n, n, n, product, transition, s->next_spread + g * n * n);
    return 1;
}

/* Moments of the states one step ahead: of the covariance the blocks along the diagonal. */
INLINE void expect_group(const Augmented *s, Py_ssize_t g)
{
    const Py_ssize_t n = s->n_states, w = s->width, b = s->block;
    const double *own = s->next_covariance + g * w * (s->n_latent + 1), *spread = s->next_spread + g * n * n;
    double *designs = s->some, *shown = designs + n * w;
    memcpy(designs, s->next_designs + g * n * w, n * w * sizeof(double));
    add_multiple(designs, 1.0, s->next_loading + g * n * w, n * w);
    triangle_times(w, n, own, s->n_latent, designs, shown, w);
    for (Py_ssize_t i = 0; i < n; i++) {
        double *row = s->state_covariances + (g * n + i) * b;
        s->states[g * n + i] = s->next_path[g * n + i] + s->next_offset[g * n + i] + dot(designs + i * w, s->next_mean + g * w, w);
        for (Py_ssize_t j = 0; j <= i % b; j++) {
            const Py_ssize_t other = i - i % b + j;
            const double value = dot(shown + i * w, designs + other * w, w);
            row[j] = value + spread[i * n + other];
            if (other < i) s->state_covariances[(g * n + other) * b + i % b] = value + spread[other * n + i];
        }
    }
}

static int augmented_all(const Augmented *s)
{
    for (Py_ssize_t g = 0; g < s->n_groups; g++) look_at_group(s, g);
    spread_looks(s);
    if (!compare_outputs(s)) return 0;
    whiten_tick(s);
    share_density(s);
    know_more(s);
    for (Py_ssize_t g = 0; g < s->n_groups; g++) {
        if (!move_group(s, g)) return 0;
        expect_group(s, g);
    }
    return 1;
}

#endif
