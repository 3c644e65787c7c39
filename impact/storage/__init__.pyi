from impact.storage import hdf5 as hdf5
