"""The reader of glTF 2.0 files, from bytes to `firefly_sample.model.data.ModelData`."""
