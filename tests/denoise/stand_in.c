/* A stand-in for Open Image Denoise's library: copies the first of color, albedo and normal to the output, and notes what is asked of it.
 *
 * STAND_IN_NOTES  file that takes a line for each device and filter, when it is made, has run and is released
 * STAND_IN_FAILS  if set, the words of the error with which every filter ends
 * LACKS           defined when it is compiled: one function is left out, as a library of another version might
 */
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

struct device {
    int threads, affinity;
    const char *error;
};

struct filter {
    struct device *device;
    float *images[4];
    size_t width, height;
    int hdr, clean, quality;
};

static const char *const NAMES[4] = {"color", "albedo", "normal", "output"};

static void note(const char *format, ...) {
    FILE *file = fopen(getenv("STAND_IN_NOTES"), "a");
    va_list values;
    va_start(values, format);
    vfprintf(file, format, values);
    va_end(values);
    fclose(file);
}

struct device *oidnNewDevice(int type) {
    struct device *device = calloc(1, sizeof *device);
    device->affinity = 1;
    return type == 1 ? device : NULL;
}

void oidnReleaseDevice(struct device *device) {
    note("device released\n");
    free(device);
}

void oidnSetDeviceBool(struct device *device, const char *name, bool value) {
    if (strcmp(name, "setAffinity") == 0)
        device->affinity = value;
}

void oidnSetDeviceInt(struct device *device, const char *name, int value) {
    if (strcmp(name, "numThreads") == 0)
        device->threads = value;
}

void oidnCommitDevice(struct device *device) { note("device of %d threads, affinity %d\n", device->threads, device->affinity); }

int oidnGetDeviceError(struct device *device, const char **words) {
    if (device == NULL || device->error == NULL)
        return 0;
    *words = device->error;
    device->error = NULL;
    return 4;
}

struct filter *oidnNewFilter(struct device *device, const char *type) {
    struct filter *filter = calloc(1, sizeof *filter);
    filter->device = device;
    if (strcmp(type, "RT") != 0)
        device->error = "another filter";
    return filter;
}

void oidnReleaseFilter(struct filter *filter) {
    note("filter released\n");
    free(filter);
}

void oidnSetSharedFilterImage(struct filter *filter, const char *name, void *pixels, int format, size_t width, size_t height, size_t offset,
                              size_t pixel_stride, size_t row_stride) {
    if (format != 3 || offset != 0 || pixel_stride != 0 || row_stride != 0)
        filter->device->error = "another format";
    for (int i = 0; i < 4; i++)
        if (strcmp(name, NAMES[i]) == 0)
            filter->images[i] = pixels;
    filter->width = width;
    filter->height = height;
}

void oidnSetFilterBool(struct filter *filter, const char *name, bool value) {
    *(strcmp(name, "hdr") == 0 ? &filter->hdr : &filter->clean) = value;
}

void oidnSetFilterInt(struct filter *filter, const char *name, int value) {
    if (strcmp(name, "quality") == 0)
        filter->quality = value;
}

void oidnCommitFilter(struct filter *filter) { (void)filter; }

#ifndef LACKS
void oidnExecuteFilter(struct filter *filter) {
    int first = 0;
    while (filter->images[first] == NULL)
        first++;
    memcpy(filter->images[3], filter->images[first], filter->width * filter->height * 3 * sizeof(float));
    note("%s, guides %d %d, hdr %d, clean %d, quality %d\n", NAMES[first], filter->images[1] != NULL && first < 1,
         filter->images[2] != NULL && first < 2, filter->hdr, filter->clean, filter->quality);
    filter->device->error = getenv("STAND_IN_FAILS");
}
#endif
